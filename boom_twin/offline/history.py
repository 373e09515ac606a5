"""History of a replay as arrays, for pictures and reports."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..compiler.compile import compile_scene
from ..plots import AlarmSpan, History, ImuTrace, Truth, replay_pictures
from ..plots.history import Orbits
from ..scene.kinematics import gravity_in_base
from ..scene.schema import Scene
from ..twin.expected_readings import tip_specific_force
from ..types import NANO, Array, Stream
from .ground_truth import TipTruth
from .recording import Recording, ResidualRows
from .replay import Replay


def draw(result: Replay, history: History, out: Path) -> list[Path]:
    """Draw the pictures of a replay, of which `history` is made, into `out`; returns their paths."""
    notes = result.session.notes
    note = notes.get("origin", "")
    truth = _truth(result.truth, history)
    return replay_pictures(out, history, truth, session=result.session.path.resolve().name, note=note)


def history_of(recording: Recording, scene: Scene) -> History:
    """Everything a replay predicted, as arrays; times from the first prediction."""
    predictions = recording.predictions
    first = int(predictions.stamps[0])
    groups = {stream: recording.of(stream) for stream in Stream}
    stamps = _seconds(predictions.stamps, first)
    felt = tip_specific_force(predictions.tip_acceleration, predictions.tip_angle, gravity_in_base(scene))
    names, times, values, sigmas = _channels(list(groups.values()), first)
    return History(
        stamps_s=stamps,
        tip_displacement=predictions.tip_displacement,
        tip_position=predictions.tip_position,
        tip_acceleration=predictions.tip_acceleration,
        joints=predictions.joints,
        cylinder_forces=predictions.cylinder_forces,
        strokes=predictions.strokes,
        residual_stamps_s=times,
        residual_names=names,
        residual_values=values,
        residual_sigmas=sigmas,
        imu=_imu(groups[Stream.IMU], stamps, felt, first),
        shapes=[(float(stamps[row]), outline.shape) for row, outline in predictions.outlines.items()],
        gaps=[((start - first) * NANO, (end - first) * NANO) for start, end in recording.gaps],
        alarms=_alarms(recording, first),
        moments=predictions.moments,
        orbits=_orbits(scene, stamps, recording),
    )


def _alarms(recording: Recording, first: int) -> list[AlarmSpan]:
    last = int(recording.predictions.stamps[-1])
    return [
        AlarmSpan(
            alarm.channel,
            (alarm.since - first) * NANO,
            ((last if alarm.until is None else alarm.until) - first) * NANO,
            alarm.cause or alarm.kind,
        )
        for alarm in recording.alarms()
    ]


def _orbits(scene: Scene, stamps: Array, recording: Recording) -> Orbits | None:
    plan = compile_scene(scene)
    if not plan.pins:
        return None
    return Orbits(stamps, plan.pins, plan.tables.clearances.gap, recording.predictions.clearances, recording.lost_contacts())


def _seconds(stamps: NDArray[np.int64], first: int) -> Array:
    return np.asarray((stamps - first) * NANO, float)


def _channels(groups: list[ResidualRows], first: int) -> tuple[tuple[str, ...], Array, Array, Array]:
    """Residuals of several streams in one table, a row per stamp and stream; NaN where a stream has no say."""
    groups = [group for group in groups if len(group.stamps)]
    names = tuple(name for group in groups for name in group.names)
    rows = sum(len(group.stamps) for group in groups)
    times, values, sigmas = np.empty(rows), np.full((rows, len(names)), np.nan), np.full((rows, len(names)), np.nan)
    row, column = 0, 0
    for group in groups:
        block = (slice(row, row + len(group.stamps)), slice(column, column + len(group.names)))
        times[block[0]] = _seconds(group.stamps, first)
        values[block], sigmas[block] = group.values, group.sigmas
        row, column = block[0].stop, block[1].stop
    return names, times, values, sigmas


def _imu(force: ResidualRows, stamps: Array, felt: Array, first: int) -> ImuTrace | None:
    if not len(force.stamps):
        return None
    times = _seconds(force.stamps, first)
    predicted = np.column_stack([np.interp(times, stamps, felt[:, i]) for i in range(2)])
    return ImuTrace(times, predicted + force.values, predicted)


def _truth(truth: TipTruth | None, history: History) -> Truth | None:
    """The truth on the time of the history: both begin with the first stroke sample."""
    if truth is None:
        return None
    return Truth(truth.times - truth.times[0] + history.stamps_s[0], truth.position, truth.acceleration)
