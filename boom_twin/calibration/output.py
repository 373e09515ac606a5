"""A calibration as files: the scene with its comments kept, and the sensors' zeros as a mapping beside it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ruamel.yaml.error import YAMLError

from ..errors import SceneError, UsageError
from ..io.atomic import check_target, write_atomic
from ..io.mapping import load_mapping
from ..io.sensors import factor
from ..io.sheet import kept
from ..plain import plain
from ..records import Stream
from ..retouch import with_value, yaml_text
from ..scene.end_mark import with_end_mark
from ..scene.parts import Scene
from ..scene.read import parse
from ..scene.structure import structure
from ..study.rewrite import anew
from .run import Calibration

DIGITS = 1e-5  # relative; values are written with six digits


def mapping_path(out: Path) -> Path:
    """Where the zeros that go with a scene are written: ``boom.mapping.yaml`` beside ``boom.yaml``."""
    return out.with_suffix(".mapping.yaml")


def picture_paths(out: Path) -> list[Path]:
    """Where the pictures that go with a scene are drawn: of residuals, and of parameters."""
    return [out.with_suffix(".residuals.png"), out.with_suffix(".parameters.png")]


def refuse_overwriting(out: Path, sources: Sequence[Path], force: bool) -> None:
    """UsageError if a file of the result is there already, or would replace one of `sources` or a file of a recording."""
    for path in (out, mapping_path(out), *picture_paths(out)):
        check_target(path, sources)
        if path.exists() and not force:
            raise UsageError(f"{path}: is there already. Name another file, or add --force to replace it.")
    if not out.parent.is_dir():
        raise UsageError(f"{out}: there is no folder {out.parent}. Make it first.")


def provenance(found: Calibration, credit: str) -> str:
    """What was changed, from what, when and by what; a few lines of text."""
    sessions = ", ".join(f"{session.name} (sha256 {session.digest}..)" for session in found.sessions)
    told = [estimate for estimate in found.estimates if estimate.told]
    before = [f"{e.unknown.name} {e.unknown.present:.6g} {e.unknown.kind.unit}" for e in told if e.unknown.channel is None]
    lines = [f"Calibrated {credit} from {sessions};", f"held out: {found.held_out}."]
    if before:
        lines.append(f"Before: {', '.join(before)}.")
    return "\n".join(lines)


def write_scene(found: Calibration, scene: Scene, text: str, out: Path, credit: str) -> None:
    """Write the scene, of which the text is given, with the values that changed, and their provenance."""
    note = provenance(found, credit)
    description = f"{scene.description.rstrip()}\n{note}" if scene.description else note
    wanted = found.scene.model_copy(update={"description": description})
    try:
        for place, value in _changes(scene.model_dump(), wanted.model_dump(), ()):
            text = with_value(text, place, value)
        read, _, faults = structure(parse(text, "calibrated scene"))
    except (YAMLError, SceneError):
        read, faults = None, []
    if read is None or faults or not _same(read.model_dump(), wanted.model_dump()):
        text = anew(wanted)  # blocks share their text, so that an edit of one changes another
    write_atomic(out, with_end_mark(text))


def write_mapping(found: Calibration, bag: Path, mapping: Path | None, out: Path, credit: str, joints: int) -> Path | None:
    """Write the zeros of the sensors into a mapping beside the scene; None if there is none to be written.

    Parameters
    ----------
    bag : Path
        A session, of which the mapping that it was recorded with is gone on from.
    mapping : Path, optional
        What was given instead.
    """
    if not found.zeros:
        return None
    text, zeros = _mapping_text(found, bag, mapping), _in_readings(found, joints)
    if "sensors" in (plain(text) or {}):
        for name, zero in zeros.items():
            text = with_value(text, ("sensors", name, "zero"), zero)
    else:
        rows = [f"  {name}: {yaml_text({'zero': zero})}" for name, zero in zeros.items()]
        text = "\n".join([*([text.rstrip()] if text.strip() else []), "sensors:", *rows]) + "\n"
    head = f"# Zeros of {', '.join(zeros)}: calibrated {credit}.\n"
    path = mapping_path(out)
    write_atomic(path, head + text)
    load_mapping(path, joints)
    return path


def _in_readings(found: Calibration, joints: int) -> dict[str, float]:
    """The new zeros by channel, in the units of the readings."""
    sensors = {name: sensor for stream in Stream for name, sensor in found.mapped.topics.sensors_of(stream, joints).items()}
    return {name: sensors[name].zero + shift / factor(name, sensors[name]) for name, shift in found.zeros.items()}


def _mapping_text(found: Calibration, bag: Path, mapping: Path | None) -> str:
    """The text that the sessions' mapping was read from; empty for the package's own."""
    if mapping is not None:
        return mapping.read_text(encoding="utf-8-sig")
    own = kept(bag, "mapping", "--mapping")
    return "" if own is None else own.text


def _changes(before: Any, after: Any, place: tuple[str | int, ...]) -> Iterator[tuple[tuple[str | int, ...], Any]]:
    """Places of the single values that differ, with their new ones."""
    if isinstance(after, dict):
        for key, value in after.items():
            yield from _changes(before.get(key) if isinstance(before, dict) else None, value, (*place, key))
    elif isinstance(after, tuple) and isinstance(before, tuple):
        for i, (one, other) in enumerate(zip(before, after, strict=True)):
            yield from _changes(one, other, (*place, i))
    elif after != before:
        yield place, after


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, dict):
        return isinstance(other, dict) and one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list):
        return isinstance(other, tuple | list) and len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=DIGITS)
    return bool(one == other)
