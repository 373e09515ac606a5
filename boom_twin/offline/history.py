"""History of a replay as arrays, for pictures and reports."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..compiler.compile import compile_scene
from ..plots import AlarmSpan, History, ImuTrace, Truth, replay_pictures
from ..plots.history import Orbits
from ..scene.kinematics import gravity_in_base
from ..scene.schema import Scene
from ..twin.expected_readings import tip_specific_force
from ..types import NANO, Array, Residuals, Stream
from .ground_truth import TipTruth
from .replay import Recording, Replay


def draw(result: Replay, history: History, out: Path) -> list[Path]:
    """Draw the pictures of a replay, of which `history` is made, into `out`; returns their paths."""
    notes = result.session.notes
    note = notes.get("origin", "")
    truth = _truth(result.truth, history)
    return replay_pictures(out, history, truth, session=result.session.path.resolve().name, note=note)


def history_of(recording: Recording, scene: Scene) -> History:
    """Everything a replay predicted, as arrays; times from the first prediction."""
    predictions = recording.predictions
    first = predictions[0].stamp
    groups = {stream: recording.of(stream) for stream in Stream}
    stamps = _seconds([prediction.stamp for prediction in predictions], first)
    acceleration = np.array([prediction.tip_acceleration for prediction in predictions])
    gravity = gravity_in_base(scene)
    felt = np.array([tip_specific_force(prediction, gravity) for prediction in predictions])
    names, times, values, sigmas = _channels(list(groups.values()), first)
    return History(
        stamps_s=stamps,
        tip_displacement=np.array([prediction.tip_displacement for prediction in predictions]),
        tip_position=np.array([prediction.tip_position for prediction in predictions]),
        tip_acceleration=acceleration,
        joints=np.array([prediction.joints for prediction in predictions]),
        cylinder_forces=np.array([prediction.cylinder_forces for prediction in predictions]),
        strokes=np.array([prediction.strokes for prediction in predictions]),
        residual_stamps_s=times,
        residual_names=names,
        residual_values=values,
        residual_sigmas=sigmas,
        imu=_imu(groups[Stream.IMU], stamps, felt, first),
        shapes=[((p.stamp - first) * NANO, p.shape) for p in predictions if p.shape is not None],
        gaps=[((start - first) * NANO, (end - first) * NANO) for start, end in recording.gaps],
        alarms=_alarms(recording, first),
        moments=np.array([prediction.moments for prediction in predictions]),
        orbits=_orbits(scene, stamps, recording),
    )


def _alarms(recording: Recording, first: int) -> list[AlarmSpan]:
    last = recording.predictions[-1].stamp
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
    return Orbits(stamps, plan.pins, plan.tables.clearances.gap, recording.clearances(), recording.lost_contacts())


def _seconds(stamps: list[int], first: int) -> Array:
    return np.array([(stamp - first) * NANO for stamp in stamps])


def _channels(groups: list[list[Residuals]], first: int) -> tuple[tuple[str, ...], Array, Array, Array]:
    """Residuals of several streams in one table, a row per stamp and stream; NaN where a stream has no say."""
    groups = [group for group in groups if group]
    names = tuple(name for group in groups for name in group[0].names)
    rows = sum(len(group) for group in groups)
    times, values, sigmas = np.empty(rows), np.full((rows, len(names)), np.nan), np.full((rows, len(names)), np.nan)
    row, column = 0, 0
    for group in groups:
        block = (slice(row, row + len(group)), slice(column, column + len(group[0].names)))
        times[block[0]] = _seconds([residuals.stamp for residuals in group], first)
        values[block] = [residuals.values for residuals in group]
        sigmas[block] = [residuals.sigmas for residuals in group]
        row, column = row + len(group), column + len(group[0].names)
    return names, times, values, sigmas


def _imu(force: list[Residuals], stamps: Array, felt: Array, first: int) -> ImuTrace | None:
    if not force:
        return None
    times = _seconds([residuals.stamp for residuals in force], first)
    predicted = np.column_stack([np.interp(times, stamps, felt[:, i]) for i in range(2)])
    return ImuTrace(times, predicted + np.array([residuals.values for residuals in force]), predicted)


def _truth(truth: TipTruth | None, history: History) -> Truth | None:
    """The truth on the time of the history: both begin with the first stroke sample."""
    if truth is None:
        return None
    return Truth(truth.times - truth.times[0] + history.stamps_s[0], truth.position, truth.acceleration)
