"""Output of a calibration: the scene with its comments kept, sensor zeros as a mapping, a text and a flat object."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..bag.session_model import mapping_text
from ..config.yaml_text import with_values
from ..messages.mapping import load_mapping
from ..messages.topic_table import factor
from ..scene.edit import rewritten
from ..scene.load import with_end_mark
from ..scene.schema import Scene
from ..system.files import check_new, write_atomic
from ..types import Stream
from .run import Calibration, Estimate


def mapping_path(out: Path) -> Path:
    """Return the path of the zeros that go with a scene: ``boom.mapping.yaml`` beside ``boom.yaml``."""
    return out.with_suffix(".mapping.yaml")


def refuse_overwriting(out: Path, sources: Sequence[Path], force: bool) -> None:
    """Raise UsageError if a file of the result exists, or would replace one of `sources` or a file of a recording."""
    for path in (out, mapping_path(out)):
        check_new(path, sources, force)


def provenance(found: Calibration, credit: str) -> str:
    """Return a few lines on the origin of the values: sessions, part held out, and the parameters' earlier values."""
    sessions = ", ".join(f"{session.name} (sha256 {session.digest}..)" for session in found.sessions)
    told = [estimate for estimate in found.estimates if estimate.told]
    before = [f"{e.unknown.name} {e.unknown.present:.6g} {e.unknown.kind.unit}" for e in told if e.unknown.channel is None]
    lines = [f"Calibrated {credit} from {sessions};", f"held out: {found.held_out}."]
    if before:
        lines.append(f"Before: {', '.join(before)}.")
    return "\n".join(lines)


def write_scene(found: Calibration, scene: Scene, text: str, out: Path, credit: str) -> None:
    """Write the scene, given its text, with the values that changed and their provenance."""
    note = provenance(found, credit)
    description = f"{scene.description.rstrip()}\n{note}" if scene.description else note
    wanted = found.scene.model_copy(update={"description": description})
    write_atomic(out, with_end_mark(rewritten(text, scene, wanted)))


def write_mapping(found: Calibration, bag: Path, mapping: Path | None, out: Path, credit: str, joints: int) -> Path | None:
    """Write the zeros of the sensors into a mapping beside the scene; return None if there are none to write.

    The zeros are added to `mapping` if given, else to the mapping of the session `bag`.
    """
    if not found.zeros:
        return None
    text, zeros = mapping_text(bag, mapping), _in_readings(found, joints)
    text = with_values(text, [(("sensors", name, "zero"), zero) for name, zero in zeros.items()])
    head = f"# Zeros of {', '.join(zeros)}: calibrated {credit}.\n"
    path = mapping_path(out)
    write_atomic(path, head + text)
    load_mapping(path, joints)
    return path


def _in_readings(found: Calibration, joints: int) -> dict[str, float]:
    sensors = {name: sensor for stream in Stream for name, sensor in found.mapped.topics.sensors_of(stream, joints).items()}
    return {name: sensors[name].zero + shift / factor(name, sensors[name]) for name, shift in found.zeros.items()}


SHOWN = {"rad": (180.0 / math.pi, "deg"), "m": (1e3, "mm")}
"""Factor and unit in which zeros are shown."""


def as_text(found: Calibration) -> list[str]:
    """Return the lines of a summary, of a table, of the unknowns that cannot be told apart, and of the residuals held out."""
    rows = [("", "before", "now", "95 % interval", ""), *(_row(estimate) for estimate in found.estimates)]
    widths = [max(len(row[i]) for row in rows) for i in range(5)]
    lines = ["  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    lines = [_summary(found), "", *lines, *(f"{group}" for group in found.groups)]
    lines += ["", f"held out: {found.held_out}; residual rms in times the expected noise (1 is right)"]
    channels = zip(found.before.names, found.before.spread.tolist(), found.after.spread.tolist(), strict=True)
    lines += [f"  {name:10s} {before:8.2f} before  {after:6.2f} now" for name, before, after in channels]
    return [
        *lines,
        f"fit: innovations at most {found.misfit:.2f} times as large as noise explains, {found.passes} passes",
        *found.remarks,
    ]


def _summary(found: Calibration) -> str:
    changed = [estimate for estimate in found.estimates if estimate.has_changed]
    names = ", ".join(" ".join(part for part in (e.unknown.name, _row(e)[4].lstrip("* ")) if part) for e in changed)
    untold = sum(not estimate.told for estimate in found.estimates)
    before, after = (max(each.spread.tolist(), default=math.nan) for each in (found.before, found.after))
    which = f": {names}" if names else ""
    return (
        f"{len(changed)} of {len(found.estimates)} parameters changed beyond their interval (*){which}; "
        f"{untold} cannot be told; the worst residual held out was {before:.1f} times the expected noise and is {after:.1f}."
    )


def as_object(found: Calibration) -> dict[str, Any]:
    """Return the result as a flat object; SI."""
    values: dict[str, Any] = {}
    for estimate in found.estimates:
        name = estimate.unknown.name
        values |= {f"{name}_before": estimate.unknown.present, f"{name}_low": estimate.low, f"{name}_high": estimate.high}
        values[name] = estimate.value if estimate.told else None
    for kind, judged in (("before", found.before), ("after", found.after)):
        spread = zip(judged.names, judged.spread.tolist(), strict=True)
        values |= {f"held_out_{kind}_{name}": value for name, value in spread}
    return values | {
        "told": [estimate.unknown.name for estimate in found.estimates if estimate.told],
        "changed": [estimate.unknown.name for estimate in found.estimates if estimate.has_changed],
        "not_told": [str(group) for group in found.groups],
        "held_out": found.held_out,
        "misfit": found.misfit,
        "passes": found.passes,
        "remarks": list(found.remarks),
    }


def _row(estimate: Estimate) -> tuple[str, str, str, str, str]:
    unit = estimate.unknown.kind.unit
    factor, unit = SHOWN.get(unit, (1.0, unit)) if estimate.unknown.channel else (1.0, unit)
    values = (estimate.unknown.present, estimate.value, estimate.low, estimate.high)
    before, now, low, high = (factor * value for value in values)
    interval = f"{low:.4g} to {high:.4g} {unit}"
    if not estimate.told:
        return estimate.unknown.name, f"{before:.4g}", "as before", interval, "cannot be told"
    change = f"{100.0 * (now / before - 1.0):+.1f} %" if estimate.unknown.kind.relative else f"{now - before:+.3g} {unit}"
    change = f"* {change}" if estimate.has_changed else change
    return estimate.unknown.name, f"{before:.4g}", f"{now:.4g}", interval, change
