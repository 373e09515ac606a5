"""Writer of ``report.html``: the report of a session in one file."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..analysis.free_vibration import Vibration
from ..health.sensor_monitor import noise_as_text
from ..offline.recording import Recording
from ..offline.replay import Replay
from ..plots import AlarmSpan
from ..plots.health import frequency_picture, moment_picture, timeline_picture
from ..scene.schema import DEPTH_BY_GYRATION
from ..system.atomic_files import write_atomic
from ..texts import alarm_sentence
from ..twin.blocks import event_meaning
from ..types import SECOND, SENSORS, Stream
from .evaluation import Evaluation
from .fatigue import LIVES, NOISE_RANGE, hours_as_text, hours_to_end, yearly_as_text
from .html import heading, image, page, paragraph, table
from .quantities import Load
from .vibration import MODE_DISTANCE, SHORTEST_REST, course

FILE_NAME = "report.html"
HOUR = 3600.0  # s
NO_JUDGE = "The rig's health was not judged."
ASSUMED = (
    f"Heights are not in the scene: assumed are {DEPTH_BY_GYRATION:g} radii of gyration, as of thin-walled boxes; "
    "see --section-height."
)


def write_report(found: Evaluation, folder: Path) -> Path:
    """Write the report into `folder` beside the pictures of the replay; return its path."""
    parts = [
        *_head(found),
        *_alarm_times(found, folder),
        *_residuals(folder),
        *_vibration(found, folder),
        *_tip(found, folder),
        *_moments(found, folder),
        *_fatigue(found),
        *_events(found),
        *_provenance(found),
    ]
    path = folder / FILE_NAME
    write_atomic(path, page(f"Session {found.name}", parts))
    return path


# -- head -------------------------------------------------------------------------------------------------------------


def _head(found: Evaluation) -> list[str]:
    summary, recording = found.result.summary, found.result.recording
    begin = datetime.fromtimestamp(recording.first // SECOND, UTC)
    rows: list[tuple[str, object]] = [
        ("first stamp", begin.strftime("%Y-%m-%d %H:%M:%S UTC")),
        ("duration, s", summary["duration_s"]),
        (f"{recording.reads.named.removesuffix('s')} samples used", summary["samples"]),
        ("samples left out", summary["dropped"]),
        ("largest tip acceleration, m/s²", summary["tip_acceleration_max_m_s2"]),
        ("largest tip displacement, m", float(np.hypot(*found.history.tip_displacement.T).max())),
        *_uncertainty(recording),
        *((name, summary[key]) for key, name in _AGAINST_TRUTH if key in summary),
        *([("load at the tip that the model does not know", summary["tip_load"])] if "tip_load" in summary else []),
        *(("noise", told) for told in noise_as_text(summary)),
    ]
    scene = f"{summary['scene']}: {len(found.scene.sections)} sections. {found.scene.description}".strip()
    return [
        heading(f"Session {found.name}", 1),
        *_verdict(found.result),
        *_worst_stations(found),
        paragraph(found.origin or "The session does not say where it comes from.", "origin"),
        paragraph(f"Scene {scene}"),
        table((), rows),
        heading("Joint angles", 3),
        table(
            ("joint", "residual, mrad rms", "mean, times the expected noise", "spread, times the expected noise"),
            _joints(summary),
        ),
    ]


_AGAINST_TRUTH = (
    ("tip_error_rms_m", "predicted tip against the truth, m rms"),
    ("tip_estimate_error_rms_m", "estimated tip against the truth, m rms"),
    ("tip_acceleration_error_rms_m_s2", "predicted tip acceleration against the truth, m/s² rms"),
    ("tip_estimate_acceleration_error_rms_m_s2", "estimated tip acceleration against the truth, m/s² rms"),
)


def _uncertainty(recording: Recording) -> list[tuple[str, object]]:
    x, z = recording.totals.tip_sigmas
    if not np.isfinite([x, z]).any():
        return []
    return [("standard deviation of the predicted tip at worst, m", f"{x:.2g} forward, {z:.2g} up")]


def _verdict(result: Replay) -> list[str]:
    if not result.recording.is_judged:
        return [paragraph(NO_JUDGE, "note")]
    alarms = sorted(result.summary["alarms"], key=lambda alarm: (not _stops(alarm), alarm["cause"] is None, alarm["from_s"]))
    if not alarms:
        return [paragraph("No alarm: no sensor gives itself away, and no residual is beyond its limit.", "well")]
    stop = "STOP. " if any(map(_stops, alarms)) else ""
    return [paragraph(f"{stop}{len(alarms)} alarm{'s' if len(alarms) > 1 else ''}.", "alarm"), *map(_alarm, alarms)]


def _stops(alarm: dict[str, Any]) -> bool:
    return alarm_sentence(alarm["channel"], alarm["kind"], alarm["cause"]).stops


WORST = 3  # stations named in the first lines


def _worst_stations(found: Evaluation) -> list[str]:
    worst = [f"{load.station.name}: {_stress(load)} MPa at {load.time:.1f} s" for load in found.loads[:WORST]]
    parts = [paragraph(f"Largest bending stresses: {'; '.join(worst)}.")] if worst else []
    if found.category is not None and found.fatigue:
        row, hours = max(found.fatigue, key=lambda row: row.damage), found.result.summary["duration_s"] / HOUR
        end = hours_to_end(row.damage, hours)
        told = "No damage: all ranges of stress are below the cut-off."
        if end is not None:
            years = ", ".join(f"{yearly_as_text(end / years)} in {years} years" for years in LIVES)
            told = (
                f"Life at {row.station.name}, detail category {found.category:g} MPa: {hours_as_text(end)} hours of such work. "
            )
            told += f"Hours a year that use it up: {years}."
        parts.append(paragraph(f"{told} Vibration that only sensors show is NOT in it, see Fatigue."))
    return parts


def _joints(summary: dict[str, Any]) -> list[tuple[object, ...]]:
    columns = ("joint_residual_rms_rad", "joint_residual_normalised_mean", "joint_residual_normalised_std")
    rows = zip(*(summary[column] for column in columns), strict=True)
    return [(i, None if rms is None else 1e3 * rms, mean, spread) for i, (rms, mean, spread) in enumerate(rows, 1)]


# -- alarms and residuals ---------------------------------------------------------------------------------------------


def _alarm_times(found: Evaluation, folder: Path) -> list[str]:
    recording, history = found.result.recording, found.history
    if not recording.is_judged:
        return []
    gaps = [AlarmSpan(recording.reads.stream.value, start, stop, "gap") for start, stop in history.gaps]
    spans = sorted([*gaps, *history.alarms], key=lambda alarm: alarm.start)
    path, end = folder / "timeline.png", float(history.stamps_s[-1])
    timeline_picture(path, found.name, end, spans, found.origin)
    return [heading("Alarms over time"), image(path, "alarms over time")]


def _alarm(alarm: dict[str, Any]) -> str:
    end = "it lasts to the end" if alarm["to_s"] is None else f"to {alarm['to_s']:.2f} s"
    evidence = f"{alarm['evidence']}; " if alarm["evidence"] else ""
    rows = [(rank["cause"], f"{100.0 * rank['probability']:.0f} %") for rank in alarm["ranked"]]
    causes = table(("possible cause", "probability"), rows) if len(rows) > 1 else ""
    cause = alarm["cause"] or f"{alarm['kind']}, its cause is not known"
    note = paragraph(f"{alarm['channel']}: {cause}; {evidence}from {alarm['from_s']:.2f} s, {end}.", "note")
    return f'<div class="block">{paragraph(alarm["told"])}{note}{causes}</div>'


def _residuals(folder: Path) -> list[str]:
    if not (folder / "residuals.png").is_file():
        return [heading("Residuals"), paragraph("Nothing was measured but what drives the model.")]
    told = "Measured minus predicted. The band is three times the expected deviation; alarms are shaded where they show."
    return [heading("Residuals"), paragraph(told, "note"), image(folder / "residuals.png", "residuals with their bands")]


# -- vibration, tip, loads --------------------------------------------------------------------------------------------


def _vibration(found: Evaluation, folder: Path) -> list[str]:
    peaks = [(0.5 * (rest.start + rest.stop), each.frequency) for rest in found.rests for each in rest.measured.values()]
    path = folder / "frequencies.png"
    frequency_picture(path, found.name, *course(found.history, found.scene), peaks, found.origin)
    source = SENSORS[Stream.ANGLES if found.history.imu is None else Stream.IMU].title
    told = (
        "Lines: the model, about the equilibrium in the posture of the moment. "
        f"Dots: free vibration in the {source} while the boom stood still for {SHORTEST_REST:g} s and more (eigensystem "
        f"realisation), within {MODE_DISTANCE:.0%} of a mode, clear of the noise, and dying away."
    )
    rows = [
        (f"{rest.start:.1f} to {rest.stop:.1f} s", mode + 1, rest.model[mode], *_measured(each, rest.model[mode]))
        for rest in found.rests
        for mode, each in sorted(rest.measured.items())
    ]
    head = ("while still", "mode", "model, Hz", "measured, Hz", "apart, %", "damping, %")
    measured = table(head, rows) if rows else paragraph("Nothing was measured: no free vibration, or no standing still.")
    shaken = ", ".join(f"{rest.start:.1f} to {rest.stop:.1f} s" for rest in found.rests if rest.is_shaken)
    why = f"Still, but shaken by a load at the tip, so that lines are no natural frequencies: {shaken}."
    left_out = [paragraph(why, "note")] if shaken else []
    title = heading("Natural frequencies and damping")
    return [title, paragraph(told, "note"), image(path, "natural frequencies"), measured, *left_out]


def _measured(each: Vibration, model: float) -> tuple[str, str, str]:
    apart, sigma = 100.0 * (each.frequency / model - 1.0), 100.0 * each.frequency_sigma / model
    return (
        f"{each.frequency:.4f} ± {each.frequency_sigma:.1g}",
        f"{apart:+.2f} ± {sigma:.1g}",
        f"{100.0 * each.damping:.2f} ± {100.0 * each.damping_sigma:.1g}",
    )


_ESTIMATE = (
    "Predicted: from the {driven} alone. Estimated: by all sensors together, with a force at the tip that the model does not "
    "know; the band is two standard deviations."
)


def _tip(found: Evaluation, folder: Path) -> list[str]:
    parts = [heading("Tip")]
    if found.history.estimate is not None:
        parts.append(paragraph(_ESTIMATE.format(driven=found.result.recording.reads.named), "note"))
    parts.append(image(folder / "tip.png", "tip displacement and acceleration"))
    return parts + [image(folder / name, name) for name in ("spectrum.png", "posture.png") if (folder / name).is_file()]


def _moments(found: Evaluation, folder: Path) -> list[str]:
    title = heading("Bending of the sections")
    if not found.loads:
        return [title, paragraph("All sections of the scene are rigid: their bending is not in the model.")]
    path = folder / "moments.png"
    worst = {load.station.section: (load.station.name, load.column) for load in reversed(found.loads)}
    moment_picture(path, found.name, found.history, [worst[section] for section in sorted(worst)], found.origin)
    told = (
        "Moments are those of the model's bending coordinates (EI times curvature), static and dynamic together, at the ends "
        "and middles of the flexible parts; positive ones bend the outboard end up. Stress is M / W with W = 2 I / h, of "
        "bending alone: no axial force, no notches, no welds. What a load at the tip adds that only sensors know of is its "
        "static share, with the standard deviation of that share. VIBRATION THAT SUCH A LOAD EXCITES IS IN NEITHER: under a "
        "pump it can be several times as much; `boom_twin response --pump` tells it. "
    )
    told += "Heights as given." if found.has_heights else ASSUMED
    head = (
        "station", "largest moment, kN m", "at, s", "static part then, kN m", "by unknown load, kN m", "W, cm³", "stress, MPa",
    )  # fmt: skip
    return [title, paragraph(told, "note"), table(head, map(_load, found.loads)), image(path, "bending moments")]


def _load(load: Load) -> tuple[object, ...]:
    unknown = "-" if np.isnan(load.sigma) else f"{1e-3 * load.unknown:+.3g} ± {1e-3 * load.sigma:.2g}"
    moments = 1e-3 * load.moment, load.time, 1e-3 * load.static
    return load.station.name, *moments, unknown, 1e6 * load.modulus, _stress(load)


def _stress(load: Load) -> str:
    deviation = "" if np.isnan(load.sigma) else f" ± {1e-6 * load.sigma / load.modulus:.2g}"
    return f"{1e-6 * load.stress:.3g}{deviation}"


def _fatigue(found: Evaluation) -> list[str]:
    if found.category is None or not found.fatigue:
        return []
    told = (
        f"Rainflow counts (ASTM E1049) of the predicted bending stress, ranges above {1e-6 * NOISE_RANGE:g} MPa; damage by the "
        f"S-N curve of EN 1993-1-9 for detail category {found.category:g} MPa, the same at all stations, without partial "
        "factors. Damage grows with the third to fifth power of stress. What only sensors know of is NOT in it: of a boom that "
        "a pump shakes this counts the moves alone, and the damage is more."
    )
    hours = found.result.summary["duration_s"] / HOUR
    rows = [
        (row.station.name, row.cycles, 1e-6 * row.largest, row.damage, hours_as_text(hours_to_end(row.damage, hours)))
        for row in found.fatigue
    ]
    head = ("station", "cycles", "largest range, MPa", "damage", "hours of such work to a damage of 1")
    return [heading("Fatigue", 3), paragraph(told, "note"), table(head, rows)]


# -- events and origin --------------------------------------------------------------------------------------------------------


def _events(found: Evaluation) -> list[str]:
    gaps = [(f"{start:.3f} to {stop:.3f} s", stop - start) for start, stop in found.history.gaps]
    reads, counted = found.result.recording.reads, found.result.summary["events"]
    events = [(name, count, event_meaning(name, reads) or "seen in a message") for name, count in counted.items()]
    return [
        heading("Gaps and events"),
        table((f"gap of the {reads.named}", "s"), gaps) if gaps else paragraph(f"No gap in the {reads.named}."),
        table(("event", "times", "what it is"), events) if events else paragraph("Nothing out of the ordinary."),
    ]


def _provenance(found: Evaluation) -> list[str]:
    summary = found.result.summary
    rows = [
        ("boom_twin", __version__),
        ("mapping", summary["mapping"]),
        ("sha256 of the result bag", summary["output_sha256"] or "no bag was written"),
        *found.result.session.notes.items(),
    ]
    return [heading("Where this comes from"), table((), rows)]
