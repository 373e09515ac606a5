"""Digital twin of a boom: samples of the rig in, predictions and residuals out. No ROS, no files, no clock."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import Any, TypeVar

import numpy as np

from ..deviation.states import Innovations
from ..errors import UsageError
from ..health.monitor import warm_up
from ..predictions import Clock
from ..scene.kinematics import strokes_of_angles
from ..types import SECOND, Array, Change, Health, Report, Sample, Stream, StrokeReading
from .adjustments import WHOLE
from .blocks import CODES, REGULAR, STREAMS, ReportBlock, SampleBlock, block_of, joined
from .sample_check import check_units, merged, samples_of
from .sample_taker import SampleTaker
from .update import DONE, FAILED, IRREGULAR

Item = TypeVar("Item", Sample, SampleBlock)
Result = TypeVar("Result")


class Twin(SampleTaker):
    """Digital twin of a boom, updated by its samples one at a time.

    Parameters
    ----------
    scene : SceneSource
        The boom: a scene, a path or a mapping, as for `boom_twin.statics`.
    settings : Settings, optional
        Noise of the sensors, tuning of the estimator, limits on time.
    mounts : sequence of Mount or None, optional
        Mount of every joint's angle sensor: None for an encoder of the joint (the default), else that of an inclinometer, see
        `boom_twin.deviation.sensor_model.Mounting`.
    health : bool
        True if the rig's health is judged, see `Report.health`.
    reads : StrokeReading
        Quantity that drives the model. Cylinder lengths include the compression of the oil. Drives, in sessions before 0.2.0,
        do not. Joint angles drive a boom without stroke transducers.
    absent : collection of str
        Channels without a sensor, such as ``joint_3``: their missing readings raise no alarm.
    doubted : collection of str
        Channels of angle sensors, of forces and of the IMU whose zeros may drift by any amount.
    causes : bool
        True if causes of faults are named (with `health`), see `boom_twin.health.fault_search`.
    is_live : bool
        True in a live node: fault twins run in another process, and `update` does not wait for them.
    places : mapping of str to Place, optional
        Places of sensors, such as ``imu_2``. The tip IMU is at the tip by default.
    lagging : collection of Stream
        Streams with an unknown lag or lead of their stamps. It is estimated, see `clocks`.
    is_follower : bool
        True for a fault twin: its samples are already checked, and their reports are empty.
    declared : mapping of str to Channel, optional
        Units, signs, zeros and scales by which a mapping turned readings to samples. Alarms of the wiring name those that the
        mapping should have, as `boom_twin mapping --check` does. By default, readings are samples.

    Attributes
    ----------
    mounts : tuple of Mount or None
        One for every joint.
    counts : Counter
        Number of each event of `boom_twin.twin.blocks.EVENTS`.
    requests : Requests
        Requested changes: another load, other limits, a restart from static equilibrium. They take effect with the next full
        stroke sample, whose `Report.change` states them.
    judge : HealthMonitor or None
        Monitor of the rig's health; None without `health`.

    Notes
    -----
    Predictions depend only on accepted samples that drive the model. All other samples correct the estimate and give residuals.
    A residual refers to the prediction interpolated at its own stamp, in whatever order samples arrive.
    """

    def __repr__(self) -> str:
        return f"Twin({self.scene!r}; {len(self.mounts)} joints; {dict(self.counts) or 'nothing odd yet'})"

    def reset(self) -> None:
        """Forget all samples; the next full stroke sample starts from static equilibrium. Load, limits and zeros stay."""
        self._restart()

    def renew(self) -> None:
        """Reset the twin to that before the first sample; load, limits and zeros stay."""
        if self._is_new:
            self.reset()
            return
        self._begin()
        self.requests.zero({})  # no new zeros: this marks a change as due with the first strokes

    @property
    def doubts(self) -> int:
        """Number of times that the estimate was doubted, because its tip was far off the predicted one."""
        return self._boom.doubts

    @property
    def evidence(self) -> float:
        """Log likelihood of all readings, up to a constant that depends on the samples alone."""
        return self._boom.evidence

    def take_innovations(self) -> Innovations:
        """Return the innovations of all channels since the last call, the first 64 of each."""
        return self._boom.take_innovations()

    @property
    def clocks(self) -> dict[Stream, Clock]:
        """Lag and drift of every lagging stream, as estimated by now."""
        return self._boom.sensors.clocks

    def rezero(self, sensor: str) -> dict[str, float]:
        """Request the mean residual of the last second as the zero of a sensor; return its new zeros by channel.

        Parameters
        ----------
        sensor : str
            ``joint_i`` (rad), ``tip_imu`` (m/s^2, both axes), ``cylinder_force_i`` (N), or ``cylinder_i`` (m). A stroke has no
            residual of its own: its zero becomes the one that explains the residual of ``joint_i``, which must read right for
            that; and the model, which the strokes drive, starts again from rest.

        Returns
        -------
        dict of str to float
            New zeros by channel, rad, m, m/s^2 or N; valid from the next full stroke sample on.

        Raises
        ------
        UsageError
            Too few residuals within the last second, or no such sensor.
        """
        channels = {name for names in self._channels.values() for name in names}
        if not channels.issuperset(WHOLE.get(sensor, (sensor,))):
            raise UsageError(f"{sensor!r}: no sensor of this boom. Give tip_imu, or one of {', '.join(sorted(channels))}.")
        kind, _, number = sensor.rpartition("_")
        if self.reads is StrokeReading.ANGLE and kind in ("cylinder", "joint"):
            told = f"{sensor}: angles drive the model, and nothing else measures them"
            raise UsageError(f"{told}. Set the zero of joint_{number} in the mapping.")
        if kind == "cylinder" and self.mounts[int(number) - 1] is not None:
            told = f"{sensor}: joint_{number} has an inclinometer, which feels every joint inboard"
            raise UsageError(f"{told}. Set the zero of {sensor} in the mapping.")
        if self._run is None:
            raise UsageError(f"{sensor}: nothing is predicted yet. Let the strokes come first.")
        found = self._recent.zeros_of(sensor, self._run.newest, self._zeros.values, self._boom.slope)
        self.requests.zero(found)
        return found

    def zeros(self, channels: Collection[str]) -> tuple[Array, Array, Array]:
        """Return the estimated zeros of sensors of angles, IMU and forces, their variances, and their errors by the scene.

        Parameters
        ----------
        channels : collection of str
            Names such as ``joint_2``; the results are in the order IMU, angles, forces.

        Returns
        -------
        values, variances, errors : ndarray, shape (channels,)
            m/s^2, rad, N, their squares, and standard deviations of what errors of the scene make of forces.
        """
        return self._boom.sensors.zeros(channels)

    def warm_up(self) -> None:
        """Compile every kernel, with a temporary twin of the same boom."""
        other = Twin(self.scene, self.settings, reads=self.reads, places=self.places)
        drive, beside = (self._drive, Stream.IMU) if self.reads is StrokeReading.ANGLE else (Stream.STROKES, Stream.ANGLES)
        middle = np.radians([sum(joint.range_deg) / 2 for joint in self.scene.joints])
        driving = middle if self.reads is StrokeReading.ANGLE else strokes_of_angles(self.scene, middle)
        for k in range(20):
            other.update(Sample(drive, k * 5_000_000, driving))
        other.update(Sample(beside, 0, middle[: len(self._channels[beside])]))
        other.update(Sample(drive, 7_000_000, driving))  # a late one is looked up among those before
        if self.judge is not None:
            warm_up()
        if self._fault_twins is not None:
            self._fault_twins.begin()

    def close(self) -> None:
        """End threads and process of a twin that names causes; no sample may follow."""
        if self._fault_twins is not None:
            self._fault_twins.close()

    def update(self, sample: Sample | Mapping[str, Any], judged: bool = True, stamp_ns: int | None = None) -> Report:
        """Take one sample; see `Report` for what comes back. Whatever the rig measures, it never raises.

        Parameters
        ----------
        sample : Sample or mapping of str to float
            Values of one stream at one stamp, in the scene's order; or readings in SI units by name, of any streams, as for
            `boom_twin.twin.sample_check.samples_of`. Their reports are one.
        judged : bool
            With the judgement of the rig's health, where that is due. If False, the report returns sooner; call `judge_health`
            next.
        stamp_ns : int, optional
            Time of readings by name, ns.

        Returns
        -------
        Report
            The prediction at a stroke sample that was followed, residuals that became known, what was out of the ordinary.

        Raises
        ------
        UsageError
            A sample that no rig can give: a stream by another name, stamps that are not nanoseconds, values not one for each
            channel. Nothing has changed then.
        """
        if isinstance(sample, Mapping):
            return merged([self.update(each, judged) for each in self.samples(sample, stamp_ns)])
        sample, self._judged = self._sample_check.checked(sample), judged
        if self._fault_twins is not None:
            self._fault_twins.reach(sample.stamp, self._failing)
        reason = IRREGULAR
        if self._run is not None and not (self.requests.due and sample.stream is self._drive):
            reason = self._advance_one(sample)
        if reason != DONE:
            return self._take_irregular(sample, reason).reports(self.plan.joints)[0]
        report = self._compiled.report(sample.stamp, judged)
        if self._fault_twins is not None and self._fault_twins.wants(CODES[sample.stream], sample.stamp):
            self._fault_twins.take(block_of([sample], self.plan.joints))
        return report

    def samples(self, readings: Mapping[str, Any], stamp_ns: int | None) -> list[Sample]:
        """Return the samples of readings by name in SI units.

        Parameters
        ----------
        readings : mapping of str to float or sequence
            As for `update`.
        stamp_ns : int
            Time of the readings, ns.

        Returns
        -------
        list of Sample
            One for each stream, strokes first.

        Raises
        ------
        UsageError
            A name, a value or the stamp cannot be used; or the first readings are in other units.
        """
        found = samples_of(readings, stamp_ns, self.plan.joints)
        if self._run is None:
            check_units(found)
        return found

    def _take_irregular(self, sample: Sample, reason: int) -> ReportBlock:
        """Take a sample that the compiled update did not take; tell the fault twins."""
        rows = self._fail(sample, []) if reason == FAILED else self._decide(sample)
        if self._fault_twins is not None:
            if (change := rows.notes.get(0, REGULAR).change) is not None:
                self._fault_twins.change(change)
            channels = b"" if self._is_complete(sample) else np.isfinite(sample.values).tobytes()
            self._fault_twins.take(block_of([sample], self.plan.joints), channels)
        return rows

    @property
    def is_health_due(self) -> bool:
        """Return True if `update` left out the judgement of health for its last sample."""
        return self._compiled.is_due

    def judge_health(self) -> Health | None:
        """Judge the rig's health, if `update` left that out for its last sample; see `Report.health`."""
        return self._compiled.judge()

    def take(self, block: SampleBlock) -> ReportBlock:
        """Take the samples of a block in turn, as `update` does each of them.

        Parameters
        ----------
        block : SampleBlock

        Returns
        -------
        ReportBlock
            Reports of the samples in their order.
        """
        found: list[ReportBlock] = []
        block = SampleBlock(*map(np.ascontiguousarray, block, (np.int64, np.int64, float)))
        row, size, drive, self._judged = 0, len(block.stamps), CODES[self._drive], True
        while row < size:
            end = row + (self._room.samples if self._run is not None and not self.requests.due else 1)
            stamp, is_drive = int(block.stamps[row]), block.streams[row] == drive
            if self._fault_twins is not None:  # they take a second before its verdict may be asked for
                self._fault_twins.reach(stamp, self._failing)
                is_later = block.stamps[row:end] // SECOND != stamp // SECOND
                end = row + int(is_later.argmax()) if is_later.any() else end
            part, reason, done = block.part(slice(row, end)), IRREGULAR, 0
            if self._run is not None and not (self.requests.due and is_drive):
                reason, done = self._compiled.advance(self._run, part)
            if done:
                part = part.part(slice(done))
                found.append(self._compiled.rows(part.stamps))
                if self._fault_twins is not None:
                    self._fault_twins.take(part)
                row += done
            if reason != DONE:
                found.append(self._take_irregular(self._sample(block, row), reason))
                row += 1
        return joined(found) if found else self._compiled.no_rows(0, REGULAR)._replace(stamps=block.stamps, notes={})

    def _sample(self, block: SampleBlock, row: int) -> Sample:
        code = int(block.streams[row])
        return Sample(STREAMS[code], int(block.stamps[row]), block.values[row, : self._widths[code]].copy())


def drive(
    twin: Twin, update: Callable[[Item], Result], items: Iterable[Item | Change | None]
) -> Iterator[tuple[Item, Result] | None]:
    """Yield each item with the result of `update`; request each change from the twin at its place.

    `update` is `twin.update` or `twin.take`. A change takes effect with the next full stroke sample, as in the recording.
    None, a message without a usable value, gives None.
    """
    for item in items:
        if isinstance(item, Change):
            twin.requests.repeat(item)
        else:
            yield None if item is None else (item, update(item))
