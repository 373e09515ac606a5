"""History of a replay as arrays, for pictures and reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.drive import drives_as_read
from ..analysis.posture_modes import ModeList
from ..analysis.undeflected import UndeflectedBoom
from ..compiler.compile import compile_scene
from ..compiler.plan import Plan
from ..deviation.estimate_row import VARIANCES
from ..deviation.sensor_model import specific_force
from ..plots import AlarmSpan, EstimateTrace, History, ImuTrace, Painter, ResidualTrace, Truth, replay_pictures
from ..plots.history import extremes
from ..plots.residuals import SessionDistributionsBuilder, running_mean
from ..plots.results import SLOW
from ..plots.session import ENLARGED_SPAN
from ..scene.kinematics import gravity_in_base
from ..scene.schema import Scene
from ..types import NANO, Array, Stream
from .ground_truth import TipTruth
from .recording import Recording, ResidualRows, Stretch
from .replay import Replay


def draw(result: Replay, history: History, scene: Scene, out: Path, paint: Painter = replay_pictures) -> list[Path]:
    """Let `paint` draw the pictures of a replay, of which `history` is made, into `out`; return their paths."""
    middles = tuple(UndeflectedBoom(scene, compile_scene(scene)).middles)
    _, natural = course(history, scene, POSTURES)
    natural = natural[:, np.isfinite(natural).any(axis=0)]
    ranges = np.column_stack([np.nanmin(natural, axis=0), np.nanmax(natural, axis=0)])
    history = replace(history, natural=ranges, section_middles=middles)
    notes = result.session.notes
    note = notes.get("origin", "")
    truth = _truth(result.truth, history)
    return paint(out, history, truth, session=result.session.path.resolve().name, note=note)


def course(history: History, scene: Scene, most: int) -> tuple[Array, Array]:
    """Return `most` even times (k,) in s, or all, and the model's natural frequencies there (k, modes), Hz.

    A frequency is NaN where there is no equilibrium, and beyond the last mode.
    """
    modes, count = ModeList(scene), len(history.stamps_s)
    places = np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))
    rows = [modes.at(history.strokes[place].tolist()) for place in places]
    table = np.full((len(rows), max(map(len, rows))), np.nan)
    for row, found in zip(table, rows, strict=True):
        row[: len(found)] = found
    return history.stamps_s[places], table


POSTURES = 9  # postures of a session whose natural frequencies are computed
LONGEST_WHOLE = 160.0  # s, of a session whose rows are all drawn
BINS = 1000.0  # parts of time of a longer session: one and a half pixels each
PREDICTED = (
    "stamps_s", "tip_displacement", "tip_position", "tip_acceleration", "joints", "cylinder_forces", "strokes", "moments",
    "slow_moments",
)  # fmt: skip
"""Fields of a `History` with a row for every prediction."""
ESTIMATED = tuple(f"estimated {each.name}" for each in fields(EstimateTrace))  # columns of the estimates beside them
EXTREME = ("tip_displacement", "tip_position", "tip_acceleration", "moments", "slow_moments", *ESTIMATED[:3])
"""Columns whose extremes are kept."""


class HistoryBuilder:
    """Builder of a session's history from its stretches.

    A session above `LONGEST_WHOLE` has `BINS` parts. Its history keeps the rows with the least or largest value of a part, and
    the rows that are shown enlarged. So curves have the full range of values, and memory hardly grows with the session.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene, self._plan = scene, compile_scene(scene)
        self._tables: dict[str, dict[str, list[Array]]] = {}  # of predictions, of each channel's residuals, of the IMU
        self._distributions = SessionDistributionsBuilder()
        self._shapes: list[tuple[float, Array]] = []
        self._peak, self._peak_at = -1.0, 0.0  # largest acceleration of the tip, and when, s

    def add(self, stretch: Stretch) -> History:
        """Add the next stretch; return the history of it alone, with all its rows."""
        own = _stretch_history(stretch, self._scene, self._plan)
        size = np.hypot(*own.tip_acceleration.T)
        if np.isfinite(size).any() and float(np.nanmax(size)) > self._peak:
            self._peak, self._peak_at = float(np.nanmax(size)), float(own.stamps_s[np.nanargmax(size)])
        self._distributions.add(own)
        width = stretch.length / BINS if stretch.length > LONGEST_WHOLE else 0.0
        estimated = dict(zip(ESTIMATED, vars(_estimate_trace(stretch)).values(), strict=True))
        self._put("predicted", {name: getattr(own, name) for name in PREDICTED} | estimated, EXTREME, width)
        for name, trace in own.residuals.items():
            self._put(name, vars(trace), ("values", "means"), width)
        if own.imu is not None:
            self._put("imu", vars(own.imu), ("measured", "predicted"), width)
        for shape in own.shapes:
            if not self._shapes or abs(shape[0] - self._shapes[-1][0]) >= width:
                self._shapes.append(shape)
        return own

    def _put(self, key: str, columns: dict[str, Array], names: Sequence[str], width: float) -> None:
        """Keep rows: if bins have a `width` (s), those with extremes of the columns `names`, and those about the peak."""
        times = next(iter(columns.values()))
        if width:
            kept = extremes((times / width).astype(np.int64), [columns[name] for name in names])
            kept |= np.abs(times - self._peak_at) <= ENLARGED_SPAN
            columns = {name: column[kept] for name, column in columns.items()}
        for name, column in columns.items():
            self._tables.setdefault(key, {}).setdefault(name, []).append(column)

    def history(self, recording: Recording) -> History:
        """Return the history of all stretches so far; at least one."""
        tables: dict[str, dict[str, Any]] = {
            key: {name: np.concatenate(parts) for name, parts in table.items()} for key, table in self._tables.items()
        }
        found, load = tables["predicted"], recording.totals.load.load
        return History(
            **{name: found[name] for name in PREDICTED},
            residuals={name: ResidualTrace(**table) for name, table in tables.items() if name not in ("predicted", "imu")},
            imu=ImuTrace(**tables["imu"]) if "imu" in tables else None,
            shapes=self._shapes,
            gaps=[((start - recording.first) * NANO, (end - recording.first) * NANO) for start, end in recording.gaps],
            alarms=_alarms(recording, float(found["stamps_s"][-1])),
            distributions=self._distributions.distributions,
            estimate=None if load is None else EstimateTrace(*(found[name] for name in ESTIMATED)),
            load_text="" if load is None else load.text,
        )


def _stretch_history(stretch: Stretch, scene: Scene, plan: Plan) -> History:
    """Return everything predicted in a stretch, with all its rows, but without gaps and alarms."""
    predictions = stretch.predictions
    stamps = _seconds(predictions.stamps, stretch.first)
    x, y = (predictions.tip_acceleration - gravity_in_base(scene)).T
    felt = np.stack(specific_force(x, y, np.cos(predictions.tip_angle), np.sin(predictions.tip_angle)), axis=1)
    return History(
        stamps_s=stamps,
        tip_displacement=predictions.tip_displacement,
        tip_position=predictions.tip_position,
        tip_acceleration=predictions.tip_acceleration,
        joints=predictions.joints,
        cylinder_forces=predictions.cylinder_forces,
        strokes=drives_as_read(plan, predictions.strokes, predictions.cylinder_forces, stretch.reads),
        residuals=_residuals(stretch),
        imu=_imu(stretch.residuals_of(Stream.IMU), stamps, felt, stretch.first),
        shapes=[(float(stamps[row]), outline.shape.copy()) for row, outline in predictions.outlines.items()],
        moments=predictions.moments,
        slow_moments=running_mean(stamps, predictions.moments, SLOW),
    )


def _estimate_trace(stretch: Stretch) -> EstimateTrace:
    estimates, predictions = stretch.estimates, stretch.predictions
    fed = estimates.is_fed[:, None]
    rigid = predictions.tip_position - predictions.tip_displacement
    xy = VARIANCES[:2]
    variances = estimates.tip_covariance[:, xy], estimates.acceleration_covariance[:, xy], estimates.load_variance
    told = estimates.tip[:, :2] - rigid, estimates.acceleration[:, :2], estimates.load
    return EstimateTrace(*(np.where(fed, each, np.nan) for each in (*told, *map(np.sqrt, variances))))


def _alarms(recording: Recording, end: float) -> list[AlarmSpan]:
    """Return the alarms of the rig's health; an alarm that lasts ends at `end`, s."""
    first = recording.first
    return [
        AlarmSpan(
            alarm.channel,
            (alarm.since - first) * NANO,
            end if alarm.until is None else (alarm.until - first) * NANO,
            alarm.cause or alarm.kind,
        )
        for alarm in recording.alarms()
    ]


def _seconds(stamps: NDArray[np.int64], first: int) -> Array:
    return np.asarray((stamps - first) * NANO, float)


def _residuals(stretch: Stretch) -> dict[str, ResidualTrace]:
    """Return the residuals of every channel of the streams that have any."""
    found = {}
    for stream in Stream:
        if not len((rows := stretch.residuals_of(stream)).stamps):
            continue
        stamps = _seconds(rows.stamps, stretch.first)
        for name, values, sigmas in zip(rows.names, rows.values.T, rows.sigmas.T, strict=True):
            known, means = np.isfinite(values), np.full_like(values, np.nan)
            means[known] = running_mean(stamps[known], values[known])
            found[name] = ResidualTrace(stamps, values, sigmas, means)
    return found


def _imu(force: ResidualRows, stamps: Array, felt: Array, first: int) -> ImuTrace | None:
    if not len(force.stamps):
        return None
    times = _seconds(force.stamps, first)
    predicted = np.column_stack([np.interp(times, stamps, felt[:, i]) for i in range(2)])
    return ImuTrace(times, predicted + force.values, predicted)


def _truth(truth: TipTruth | None, history: History) -> Truth | None:
    """Return the truth on the time of the history; both begin with the first stroke sample."""
    if truth is None:
        return None
    return Truth(truth.times - truth.times[0] + history.stamps_s[0], truth.position, truth.acceleration)
