"""Input and output of commands: scenes and sessions; results on stdout, notes and warnings on stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from ..errors import Fault
from ..system.result_text import json_text

if TYPE_CHECKING:
    from ..bag.reader import Session
    from ..bag.session_model import SessionScene
    from ..config.settings import Settings
    from ..scene import Scene


_kept: TextIO | None = None  # standard error, for the lines that ``--quiet`` keeps


@contextmanager
def quiet() -> Iterator[None]:
    """Discard what is printed on standard error within the context, except lines that are kept."""
    global _kept
    with open(os.devnull, "w", encoding="utf-8") as nothing:
        try:
            _kept = sys.stderr
            with redirect_stderr(nothing):
                yield
        finally:
            _kept = None


def tell(text: str, is_kept: bool = False) -> None:
    """Print a line on stderr. ``--quiet`` discards it unless it `is_kept`."""
    print(text, file=(_kept if is_kept else None) or sys.stderr, flush=True)


def warn(text: str) -> None:
    tell(f"warning: {text}", is_kept=True)


def open_scene(source: str | None) -> Scene:
    """Return the scene of an argument; print its warnings on stderr."""
    from ..scene.load import examine

    scene, oddities = examine(source)
    if source is None:
        tell("scene: default scene, the package's own rig; give SCENE for another")
    tell_oddities(oddities, source)
    return scene


def open_session_scene(session: str | Path, source: str | None) -> SessionScene:
    """Return the scene of a session, see `boom_twin.bag.session_model.scene_of`; print source and warnings on stderr."""
    from ..bag.reader import refuse_absent
    from ..bag.session_model import scene_of

    refuse_absent(Path(session))  # before the model is compiled
    found = scene_of(Path(session), source)
    tell(f"scene: {found.source} (sha256 {found.sha256[:12]}..)")
    tell_oddities(found.oddities, found.source)
    return found


def open_session_settings(session: str | Path, params: Path | None, namespace: str = "") -> Settings:
    """Return the settings of a session's twin, see `boom_twin.bag.session_model.settings_of`; print unusual ones on stderr."""
    from ..bag.session_model import settings_of

    found = settings_of(Path(session), params, namespace)
    if found.others:
        tell(f"parameters: {found.source}: " + ", ".join(f"{name} {value:g}" for name, value in found.others.items()))
    return found.settings


def tell_oddities(oddities: Iterable[Fault], source: str | None) -> None:
    for oddity in oddities:
        tell(f"{oddity.kind}: {source}: {oddity}", is_kept=oddity.kind == "warning")


def warn_incomplete(session: Session) -> None:
    """Warn on stderr if a session is incomplete, or messages never reached the recorder."""
    from ..bag.session_model import missed_messages

    if session.incomplete:
        warn(f"{session.path}: {session.incomplete}")
    if missed := missed_messages(session.path):
        told = ", ".join(f"{count} of {topic}" for topic, count in missed.items()) + ". A node that got them had other results"
        warn(f"{session.path}: never reached the recorder: {told}")


def print_result(is_json: bool, values: Mapping[str, Any], lines: Iterable[str]) -> None:
    """Print `values` as one flat JSON object (null for numbers that are not finite), or `lines` for people."""
    print(json_text(values) if is_json else "\n".join(lines))


def columns(rows: Sequence[Sequence[str]], left: Iterable[int] = (0,)) -> list[str]:
    """Return rows of cells as aligned lines: columns with index in `left` to the left, others to the right."""
    widths, at_left = [max(map(len, cells)) for cells in zip(*rows, strict=True)], frozenset(left)
    return [
        "  ".join(
            cell.ljust(w) if i in at_left else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
