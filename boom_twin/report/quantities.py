"""Quantities of a session with their standard deviations, bending moments and stresses included, for comparisons."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from hashlib import sha256
from math import hypot, sqrt
from pathlib import Path

import numpy as np

from ..analysis.bending_moments import Station, stations
from ..config.settings import Settings
from ..errors import BagError, UsageError
from ..health.baseline import Baseline, judged_channels
from ..offline.recording import Recording
from ..plots import History
from ..plots.health import slow_part
from ..scene.schema import Scene
from ..system.atomic_files import write_atomic
from ..system.received_files import open_received
from ..types import Array, sensor_kind
from .vibration import HoldInterval

FILE_NAME = "quantities.json"
BATCHES = 10
"""Parts of a session whose means show how sure the mean of all is (method of batch means)."""
LEG = 1e-3
"""m; a stroke has turned when it came back by this."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """One figure: its standard deviation is None where it is not known; units are SI."""

    name: str
    value: float
    sigma: float | None
    unit: str


def quantities(
    recording: Recording, history: History, still: list[HoldInterval], scene: Scene, settings: Settings, baseline: Baseline
) -> list[Quantity]:
    """All figures of one replay."""
    return [
        *_residuals(history, baseline, len(scene.joints)),
        *_frequencies(still, baseline.detuning),
        *_tip(recording, history),
        *_moments(history, scene),
        *_travels(history, settings),
    ]


def _residuals(history: History, baseline: Baseline, joints: int) -> Iterator[Quantity]:
    """Mean and root mean square of every channel; the model's error in a posture counts as uncertainty of the mean.

    Where the baseline does not have that error, it is not known how sure the figures are.
    """
    errors = dict(zip(judged_channels(joints), baseline.errors(joints).tolist(), strict=True))
    for name, column in zip(history.residual_names, history.residual_values.T, strict=True):
        values, unit = column[np.isfinite(column)], sensor_kind(name).unit
        if len(values) < BATCHES:
            continue
        mean, mean_sigma = batch_mean(values)
        square, square_sigma = batch_mean(values**2)
        rms, mean_error, rms_error = sqrt(square), None, None
        if (error := errors.get(name)) is not None:
            mean_error = hypot(mean_sigma, error)
            rms_error = hypot(square_sigma, 2.0 * mean * error) / (2.0 * rms) if rms else 0.0
        yield Quantity(f"residual_mean_{name}", mean, mean_error, unit)
        yield Quantity(f"residual_rms_{name}", rms, rms_error, unit)


def batch_mean(values: Array) -> tuple[float, float]:
    """Mean of a row of values (k,), and its standard deviation from those of `BATCHES` batches."""
    means = np.array([part.mean() for part in np.array_split(values, BATCHES)])
    return float(values.mean()), float(means.std(ddof=1) / sqrt(BATCHES))


def _frequencies(still: list[HoldInterval], detuning: float) -> Iterator[Quantity]:
    """Of every mode that was seen: measured over model frequency, and damping.

    The ratio is that of the rig to the model in any posture, but for the `detuning` that the model may have in each.
    """
    for mode in sorted({mode for hold in still for mode in hold.measured}):
        seen = [(hold.model[mode], hold.measured[mode]) for hold in still if mode in hold.measured]
        ratios = np.array([(each.frequency / model, each.frequency_sigma / model) for model, each in seen])
        dampings = np.array([(each.damping, each.damping_sigma) for _, each in seen])
        yield _weighted(f"frequency_ratio_mode_{mode + 1}", ratios, detuning)
        yield _weighted(f"damping_mode_{mode + 1}", dampings, 0.0)


def _weighted(name: str, rows: Array, error: float) -> Quantity:
    """Weighted mean of values and deviations (k, 2), as unsure as these say or the values scatter, and by `error` besides."""
    weights = rows[:, 1] ** -2.0
    mean = float(weights @ rows[:, 0] / weights.sum())
    scatter = float(weights @ (rows[:, 0] - mean) ** 2 / max(len(rows) - 1, 1))
    return Quantity(name, mean, hypot(sqrt(max(1.0, scatter) / weights.sum()), error), "1")


def _tip(recording: Recording, history: History) -> Iterator[Quantity]:
    """Peaks of the predicted tip; of the displacement with what the judge of health says of the predicted position."""
    sigmas = np.array([health.tip_sigmas for health in recording.health]).reshape(-1, 2)
    known = sigmas[np.isfinite(sigmas).all(axis=1)]
    sigma = float(np.hypot(*known.T).max()) if len(known) else None
    yield Quantity("tip_displacement_max", float(np.hypot(*history.tip_displacement.T).max()), sigma, "m")
    yield Quantity("tip_acceleration_max", float(np.hypot(*history.tip_acceleration.T).max()), None, "m/s^2")


def _moments(history: History, scene: Scene) -> Iterator[Quantity]:
    """Largest bending moment of every flexible section."""
    for load in loads(history, scene, None):
        yield Quantity(f"bending_moment_max_section_{load.station.section + 1}", abs(load.moment), None, "N m")


def _travels(history: History, settings: Settings) -> Iterator[Quantity]:
    for i, stroke in enumerate(history.strokes.T):
        travel, legs = path_length(stroke)
        sigma = sqrt(2.0 * legs * settings.stroke_variance)
        yield Quantity(f"stroke_travel_cylinder_{i + 1}", travel, sigma, "m")


def path_length(stroke: Array) -> tuple[float, int]:
    """How far a stroke (k,), m, has gone back and forth, and in how many legs; what does not come back by `LEG` is noise."""
    turns, way = [float(stroke[0])], 0
    extreme = turns[0]
    for value in stroke.tolist():
        if way and (extreme - value) * way > LEG:
            turns.append(extreme)
            extreme, way = value, -way
        elif not way and abs(value - turns[0]) > LEG:
            extreme, way = value, 1 if value > turns[0] else -1
        elif way and (value - extreme) * way > 0.0:
            extreme = value
    if not way:
        return 0.0, 0
    turns.append(extreme)
    return float(np.abs(np.diff(turns)).sum()), len(turns) - 1


def write(folder: Path, scene: Scene, found: list[Quantity]) -> Path:
    """Keep them beside ``summary.json``; returns the file."""
    path = folder / FILE_NAME
    rows = ",\n".join(f"  {json.dumps(asdict(each))}" for each in found)
    write_atomic(path, f'{{\n "scene_sha256": "{digest(scene)}",\n "quantities": [\n{rows}\n ]\n}}\n')
    return path


def read(folder: Path) -> tuple[str, list[Quantity]]:
    """Digest of the scene, and the figures, of a replay folder; BagError if they are not there."""
    path = folder / FILE_NAME
    try:
        with open_received(path) as file:
            content = json.load(file)
        return str(content["scene_sha256"]), [Quantity(**row) for row in content["quantities"]]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BagError(f"{path}: {error}. Replay the session again with `boom_twin replay`.") from None


def digest(scene: Scene) -> str:
    """Of everything in a scene."""
    return sha256(scene.model_dump_json().encode()).hexdigest()


BOX = 2.4
"""Height over radius of gyration of a thin-walled box, for sections whose height is not given."""


@dataclass(frozen=True, slots=True)
class Load:
    """The most loaded station of a section.

    Attributes
    ----------
    station : Station
    column : int
        Of `History.moments`.
    moment, time, static : float
        The largest moment in magnitude (N m), when (s), and the static part of it then (N m).
    height : float
        Of the section, m.
    stress : float
        Of its outermost fibre by bending, Pa.
    """

    station: Station
    column: int
    moment: float
    time: float
    static: float
    height: float
    stress: float


def loads(history: History, scene: Scene, heights: Array | None) -> list[Load]:
    """One for every flexible section; `heights` (n,) of the sections in m, or None to take them for thin-walled boxes."""
    places = stations(scene)
    found = []
    for section in sorted({station.section for station in places}):
        columns = [i for i, station in enumerate(places) if station.section == section]
        size = np.abs(history.moments[:, columns])
        row, best = np.unravel_index(int(size.argmax()), size.shape)
        column = columns[int(best)]
        moment, part = float(history.moments[row, column]), scene.sections[section]
        assert part.A is not None and part.I is not None
        height = BOX * math.sqrt(part.I / part.A) if heights is None else float(heights[section])
        static = float(slow_part(history, column)[row])
        stress = abs(moment) * height / 2.0 / part.I
        found.append(Load(places[column], column, moment, float(history.stamps_s[row]), static, height, stress))
    return found


def section_heights(text: str | None, scene: Scene) -> Array | None:
    """Heights (m) of all sections from ``h1,h2,..``; UsageError unless there is one above 0 for each."""
    if text is None:
        return None
    count = len(scene.sections)
    try:
        heights = np.array([float(part) for part in text.split(",")])
    except ValueError:
        heights = np.zeros(0)
    if len(heights) != count or not (np.isfinite(heights) & (heights > 0.0)).all():
        raise UsageError(f"--section-height {text}: give {count} heights above 0, in m, with commas between them.")
    return heights
