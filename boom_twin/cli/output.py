"""Scenes and sessions that commands open, and what they print: results on stdout, news and warnings on stderr."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from io import TextIOBase
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from ..errors import Fault

if TYPE_CHECKING:
    from ..bag.reader import Session
    from ..bag.session_model import SessionScene
    from ..config.settings import Settings
    from ..scene import Scene


def tell(text: str) -> None:
    """Print a line on stderr; ``--quiet`` leaves it out unless it is a warning."""
    print(text, file=sys.stderr, flush=True)


def warn(text: str) -> None:
    """Print a warning on stderr."""
    tell(f"warning: {text}")


KEPT = ("warning", "boom_twin ", "usage:", "open ")
"""How lines begin that ``--quiet`` leaves; the last one is the address of the live page."""


class QuietStream(TextIOBase):
    """Text stream that passes on to `stream` only lines that begin with one of `KEPT`."""

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._begun = stream, ""

    def write(self, text: str) -> int:
        """Take text in; a line is passed on when it is complete."""
        *lines, self._begun = (self._begun + text).replace("\r", "\n").split("\n")
        for line in lines:
            if line.startswith(KEPT):
                self._stream.write(f"{line}\n")
        return len(text)

    def flush(self) -> None:
        """Pass on what was written so far, as far as it is complete."""
        self._stream.flush()


def open_scene(source: str | None) -> Scene:
    """Return the scene of an argument; its warnings go to stderr, one line each."""
    from ..scene.load import examine

    scene, oddities = examine(source)
    if source is None:
        tell("scene: default scene, the package's own rig; give SCENE for another")
    tell_oddities(oddities, source)
    return scene


def open_session_scene(session: str | Path, source: str | None) -> SessionScene:
    """Return the scene of a session, see `boom_twin.bag.session_model.scene_of`; its source and warnings go to stderr."""
    from ..bag.session_model import scene_of

    found = scene_of(Path(session), source)
    tell(f"scene: {found.source} (sha256 {found.sha256[:12]}..)")
    tell_oddities(found.oddities, found.source)
    return found


def open_session_settings(session: str | Path, params: Path | None, namespace: str = "") -> Settings:
    """Return the settings of a session's twin, see `boom_twin.bag.session_model.settings_of`; unusual ones go to stderr."""
    from ..bag.session_model import settings_of

    found = settings_of(Path(session), params, namespace)
    if found.others:
        tell(f"parameters: {found.source}: " + ", ".join(f"{name} {value:g}" for name, value in found.others.items()))
    return found.settings


def tell_oddities(oddities: Iterable[Fault], source: str | None) -> None:
    """Print warnings and notes on stderr, with the file that they are about."""
    for oddity in oddities:
        tell(f"{oddity.kind}: {source}: {oddity}")


def warn_incomplete(session: Session) -> None:
    """Warn on stderr if a session is incomplete, its recorder's clock was set back, or messages never reached the recorder."""
    from ..bag.reader import clocks_set_back
    from ..bag.session_sheet import missed_messages

    if session.incomplete:
        warn(f"{session.path}: {session.incomplete}")
    for told in clocks_set_back(session):
        warn(told)
    if missed := missed_messages(session.path):
        told = ", ".join(f"{count} of {topic}" for topic, count in missed.items()) + "; a node that got them told otherwise"
        warn(f"{session.path}: never reached the recorder: {told}")


def print_result(is_json: bool, values: Mapping[str, Any], lines: Iterable[str]) -> None:
    """Print a result: `values` as one flat JSON object, in which a number that is not finite is null, or `lines` for people."""
    print(json.dumps(plain_values(values), allow_nan=False) if is_json else "\n".join(lines))


def plain_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values as JSON has them; a number that is not finite becomes None."""
    return {key: _plain(value) for key, value in values.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        raise TypeError("the object must be flat")
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and value - value != 0.0:
        return None
    return value


def columns(rows: Sequence[Sequence[str]], left: Iterable[int] = (0,)) -> list[str]:
    """Return rows of aligned cells as lines. Columns of the numbers `left` are aligned to the left, the others to the right."""
    widths, at_left = [max(map(len, cells)) for cells in zip(*rows, strict=True)], frozenset(left)
    return [
        "  ".join(
            cell.ljust(w) if i in at_left else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
