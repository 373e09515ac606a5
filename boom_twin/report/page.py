"""Pages of HTML from the folder ``templates``, each of one file: ``report.html``, the report of a session."""

from __future__ import annotations

from base64 import b64encode
from datetime import UTC, datetime
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from .. import __version__
from ..analysis.posture_modes import MODE_DISTANCE
from ..analysis.sample_series import Vibration
from ..offline.history import course
from ..offline.recording import noise_told
from ..plots import AlarmSpan
from ..plots.results import frequency_picture, moment_picture, timeline_picture
from ..scene.schema import DEPTH_BY_GYRATION
from ..system.files import write_atomic
from ..texts import alarm_sentence
from ..twin.blocks import event_meaning
from ..types import SECOND, SENSORS, Stream
from .evaluation import Evaluation
from .fatigue import LIVES, NOISE_RANGE, hours_as_text, hours_to_end, yearly_as_text
from .quantities import Load
from .vibration import SHORTEST_REST

FILE_NAME = "report.html"
HOUR = 3600.0  # s
AGAINST_TRUTH = (
    ("tip_error_rms_m", "predicted tip against the truth, m rms"),
    ("tip_estimate_error_rms_m", "estimated tip against the truth, m rms"),
    ("tip_acceleration_error_rms_m_s2", "predicted tip acceleration against the truth, m/s² rms"),
    ("tip_estimate_acceleration_error_rms_m_s2", "estimated tip acceleration against the truth, m/s² rms"),
)


def write_report(found: Evaluation, folder: Path) -> Path:
    """Write the report into `folder` beside the pictures of the replay; return its path."""
    recording, history, summary = found.result.recording, found.history, found.result.summary
    reads, notes = recording.reads, found.result.session.notes
    name, origin = found.result.session.path.resolve().name, notes.get("origin", "")
    _draw(found, folder, name, origin)
    alarms = sorted(summary["alarms"], key=lambda alarm: (not _stops(alarm), alarm["cause"] is None, alarm["from_s"]))
    text = render(
        "report.html",
        title=f"Session {name}",
        folder=folder,
        drawn={path.name for path in folder.glob("*.png")},
        origin=origin,
        scene=f"{summary['scene']}: {len(found.scene.sections)} sections. {found.scene.description}".strip(),
        alarms=[_alarm(alarm) for alarm in alarms] if recording.is_judged else None,
        stops=any(map(_stops, alarms)),
        worst=[f"{load.station.name}: {_stress(load)} MPa at {load.time:.1f} s" for load in found.loads[:3]],
        life=_life(found),
        facts=_facts(found),
        joints=_joints(summary),
        source=SENSORS[Stream.ANGLES if history.imu is None else Stream.IMU].title,
        shortest_rest=f"{SHORTEST_REST:g}",
        mode_distance=f"{MODE_DISTANCE:.0%}",
        rests=[
            (f"{rest.start:.1f} to {rest.stop:.1f} s", mode + 1, rest.model[mode], *_measured(each, rest.model[mode]))
            for rest in found.rests
            for mode, each in sorted(rest.measured.items())
        ],
        shaken=[f"{rest.start:.1f} to {rest.stop:.1f} s" for rest in found.rests if rest.is_shaken],
        driven=reads.named,
        is_estimated=history.estimate is not None,
        loads=list(map(_load, found.loads)),
        has_heights=found.has_heights,
        gyration=f"{DEPTH_BY_GYRATION:g}",
        noise_range=f"{1e-6 * NOISE_RANGE:g}",
        category="" if found.category is None else f"{found.category:g}",
        fatigue=_fatigue(found),
        gaps=[(f"{start:.3f} to {stop:.3f} s", stop - start) for start, stop in history.gaps],
        events=[
            (event, count, event_meaning(event, reads) or "seen in a message") for event, count in summary["events"].items()
        ],
        provenance=[
            ("boom_twin", __version__),
            ("mapping", summary["mapping"]),
            ("sha256 of the result bag", summary["output_sha256"] or "no bag was written"),
            *notes.items(),
        ],
    )
    write_atomic(folder / FILE_NAME, text)
    return folder / FILE_NAME


def _draw(found: Evaluation, folder: Path, name: str, origin: str) -> None:
    """Draw the pictures that the report has beside those of the replay."""
    recording, history = found.result.recording, found.history
    if recording.is_judged:
        gaps = [AlarmSpan(recording.reads.stream.value, start, stop, "gap") for start, stop in history.gaps]
        spans = sorted([*gaps, *history.alarms], key=lambda alarm: alarm.start)
        timeline_picture(folder / "timeline.png", name, float(history.stamps_s[-1]), spans, origin)
    peaks = [(0.5 * (rest.start + rest.stop), each.frequency) for rest in found.rests for each in rest.measured.values()]
    frequency_picture(folder / "frequencies.png", name, *course(history, found.scene, 60), peaks, origin)
    if found.loads:
        worst = {load.station.section: (load.station.name, load.column) for load in reversed(found.loads)}
        moment_picture(folder / "moments.png", name, history, [worst[section] for section in sorted(worst)], origin)


def _facts(found: Evaluation) -> list[tuple[str, object]]:
    summary, recording = found.result.summary, found.result.recording
    begin, (x, z) = datetime.fromtimestamp(recording.first // SECOND, UTC), recording.totals.tip_sigmas
    is_judged = np.isfinite([x, z]).any()
    return [
        ("first stamp", begin.strftime("%Y-%m-%d %H:%M:%S UTC")),
        ("duration, s", summary["duration_s"]),
        (f"{recording.reads.named.removesuffix('s')} samples used", summary["samples"]),
        ("samples left out", summary["dropped"]),
        ("largest tip acceleration, m/s²", summary["tip_acceleration_max_m_s2"]),
        ("largest tip displacement, m", float(np.hypot(*found.history.tip_displacement.T).max())),
        *([("standard deviation of the predicted tip at worst, m", f"{x:.2g} forward, {z:.2g} up")] if is_judged else []),
        *((name, summary[key]) for key, name in AGAINST_TRUTH if key in summary),
        *([("load at the tip that the model does not know", summary["tip_load"])] if "tip_load" in summary else []),
        *(("noise", told) for told in noise_told(summary)),
    ]


def _joints(summary: dict[str, Any]) -> list[tuple[object, ...]]:
    columns = ("joint_residual_rms_rad", "joint_residual_normalised_mean", "joint_residual_normalised_std")
    rows = zip(*(summary[column] for column in columns), strict=True)
    return [(i, None if rms is None else 1e3 * rms, mean, spread) for i, (rms, mean, spread) in enumerate(rows, 1)]


def _stops(alarm: dict[str, Any]) -> bool:
    return alarm_sentence(alarm["channel"], alarm["kind"], alarm["cause"]).stops


def _alarm(alarm: dict[str, Any]) -> tuple[dict[str, Any], str, list[tuple[str, str]]]:
    """Return an alarm, a note on cause, evidence and time, and its possible causes with their probabilities."""
    end = "it lasts to the end" if alarm["to_s"] is None else f"to {alarm['to_s']:.2f} s"
    evidence = f"{alarm['evidence']}; " if alarm["evidence"] else ""
    cause = alarm["cause"] or f"{alarm['kind']}, its cause is not known"
    note = f"{alarm['channel']}: {cause}; {evidence}from {alarm['from_s']:.2f} s, {end}."
    return alarm, note, [(rank["cause"], f"{100.0 * rank['probability']:.0f} %") for rank in alarm["ranked"]]


def _life(found: Evaluation) -> str:
    """Return the life of the station with the largest damage in words; empty without fatigue."""
    if not found.fatigue:
        return ""
    row = max(found.fatigue, key=lambda row: row.damage)
    end = hours_to_end(row.damage, found.result.summary["duration_s"] / HOUR)
    if end is None:
        return "No damage: all ranges of stress are below the cut-off."
    years = ", ".join(f"{yearly_as_text(end / years)} in {years} years" for years in LIVES)
    told = f"Life at {row.station.name}, detail category {found.category:g} MPa: {hours_as_text(end)} hours of such work."
    return f"{told} Hours a year that use it up: {years}."


def _fatigue(found: Evaluation) -> list[tuple[object, ...]]:
    hours = found.result.summary["duration_s"] / HOUR
    return [
        (row.station.name, row.cycles, 1e-6 * row.largest, row.damage, hours_as_text(hours_to_end(row.damage, hours)))
        for row in found.fatigue
    ]


def _measured(each: Vibration, model: float) -> tuple[str, str, str]:
    apart, sigma = 100.0 * (each.frequency / model - 1.0), 100.0 * each.frequency_sigma / model
    return (
        f"{each.frequency:.4f} ± {each.frequency_sigma:.1g}",
        f"{apart:+.2f} ± {sigma:.1g}",
        f"{100.0 * each.damping:.2f} ± {100.0 * each.damping_sigma:.1g}",
    )


def _load(load: Load) -> tuple[object, ...]:
    unknown = "-" if np.isnan(load.sigma) else f"{1e-3 * load.unknown:+.3g} ± {1e-3 * load.sigma:.2g}"
    moments = 1e-3 * load.moment, load.time, 1e-3 * load.static
    return load.station.name, *moments, unknown, 1e6 * load.modulus, _stress(load)


def _stress(load: Load) -> str:
    deviation = "" if np.isnan(load.sigma) else f" ± {1e-6 * load.sigma / load.modulus:.2g}"
    return f"{1e-6 * load.stress:.3g}{deviation}"


def render(template: str, **values: Any) -> str:
    """Return the page that a template makes of `values`. Texts are escaped, except `Markup`."""
    loader = FileSystemLoader(Path(__file__).parent / "templates")
    environment = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined)
    environment.filters |= {"cell": _cell, "data": _data_address}
    return environment.get_template(template).render(values)


def _cell(value: object) -> Markup:
    """Return the cell of a table: numbers right-aligned with 4 significant digits, None and NaN as a dash."""
    if value is None or (isinstance(value, float) and not isfinite(value)):
        return Markup('<td class="n">-</td>')
    if isinstance(value, float | int):
        return Markup('<td class="n">{}</td>').format(f"{value:.4g}" if isinstance(value, float) else value)
    return Markup("<td>{}</td>").format(value)


def _data_address(path: Path) -> str:
    return f"data:image/png;base64,{b64encode(path.read_bytes()).decode()}"
