"""The twin: samples of the rig in, predictions and residuals out. No ROS, no files, no clock."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from ..config.settings import Settings
from ..errors import UsageError
from ..health.monitor import warm_up
from ..scene.kinematics import strokes_of_angles
from ..types import SECOND, Array, Health, Report, Sample, Stream, StrokeReading
from .block_update import CAPACITY
from .blocks import STREAMS, ReportBlock, SampleBlock, block_of
from .loaded_model import LoadedModel
from .readings import check_units, merged, samples_of
from .sample_taker import SampleTaker
from .update import DONE, FAILED


class Twin(SampleTaker):
    """Digital twin of a boom, updated by its samples one at a time.

    Parameters
    ----------
    scene : SceneSource
        The boom: a scene, a path or a mapping, as for `boom_twin.statics`.
    settings : Settings, optional
        Noise of the sensors, tuning of the estimator, limits on time.
    mounts : sequence of Mount or None, optional
        Of every joint's angle sensor: None is an encoder of the joint (the default), else an inclinometer, see
        `boom_twin.deviation.sensor_model.Mounting`.
    health : bool
        Judge the rig's health, see `Report.health`.
    reads : StrokeReading
        What drives the model: the lengths of the cylinders, oil compressed; of sessions that were made before version 0.2.0,
        their drives; or, of a boom without stroke transducers, the angles of its joints.
    absent : collection of str
        Channels without a sensor, such as ``joint_3``: no reading of them is missed.
    doubted : collection of str
        Channels of angle sensors, of forces and of the IMU whose zeros may drift by any amount.
    causes : bool
        With `health`, causes of faults are named, see `boom_twin.health.fault_twins`.
    is_live : bool
        True if no sample may wait for the name of a cause.
    places : mapping of str to Place, optional
        Of sensors that have one, such as ``imu_2``. The tip IMU is at the tip if it is not among them.

    Attributes
    ----------
    mounts : tuple of Mount or None
        As given, one for every joint.
    counts : Counter
        How often each of `boom_twin.twin.events.EVENTS` happened.
    requests : Requests
        What is asked while samples come: another load, other limits, a start from rest. It takes effect with the next full
        stroke sample, which `Report.change` tells.
    shedding : LoadShedding
        Is told by a live user how full the queue of samples is; decides what is then left out.
    judge : HealthMonitor or None
        Of the rig's health; None without `health`.

    Notes
    -----
    Everything predicted is a function of the accepted samples that drive the model alone; all others only give residuals, each
    against the prediction interpolated at its own stamp, in whatever order samples arrive.
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
        self.requests.zero({})  # what they are holds with the first strokes

    @property
    def evidence(self) -> float:
        """Log likelihood of all readings, up to a constant that depends on the samples alone."""
        return self._boom.evidence

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
            What its channels read too much, rad, m, m/s^2 or N; it holds from the next full stroke sample on.

        Raises
        ------
        UsageError
            Too few residuals within the last second.
        """
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

    def model(self, settings: Settings) -> LoadedModel:
        """Return the model under the load of `settings`, for `requests.tune`; another thread may call this.

        Parameters
        ----------
        settings : Settings

        Returns
        -------
        LoadedModel
        """
        return self._model(settings)

    def zeros(self, channels: Collection[str]) -> tuple[Array, Array]:
        """Return the estimated zeros of sensors of angles, IMU and forces, and their variances.

        Parameters
        ----------
        channels : collection of str
            Names such as ``joint_2``; the results are in the order IMU, angles, forces.

        Returns
        -------
        values, variances : ndarray, shape (channels,)
            m/s^2, rad, N, and their squares.
        """
        return self._boom.zeros(channels)

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

    def update(self, sample: Sample | Mapping[str, Any], judged: bool = True, stamp_ns: int | None = None) -> Report:
        """Take one sample; see `Report` for what comes back. Whatever the rig measures, it never raises.

        Parameters
        ----------
        sample : Sample or mapping of str to float
            Values of one stream at one stamp, in the scene's order; or readings in SI units by name, of any streams, as for
            `boom_twin.twin.readings.samples_of`. Their reports are one.
        judged : bool
            With the judgement of the rig's health, where that is due. Without it the rest comes sooner, and `judge_health`
            is to be called next.
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
        sample, self._judged = self._edge.checked(sample), judged
        if self._fault_twins is not None:
            self._fault_twins.reach(sample.stamp, self._failing)
        if self._run is None or (self.requests.due and sample.stream is self._drive):
            return self._told(sample, self._look_at(sample))
        reason = self._advance_one(sample)
        if reason == DONE:
            return self._told(sample, self._compiled.report(sample.stamp, (), judged))
        return self._told(sample, self._fail(sample, []) if reason == FAILED else self._look_at(sample))

    def samples(self, readings: Mapping[str, Any], stamp_ns: int | None) -> list[Sample]:
        """Return a sample of each stream of readings by name, strokes first; raises as `update` does.

        Parameters
        ----------
        readings : mapping of str to float or sequence
            As for `boom_twin.twin.readings.samples_of`.
        stamp_ns : int
            Time of the readings, ns.

        Returns
        -------
        list of Sample
        """
        found = samples_of(readings, stamp_ns, self.plan.joints)
        if self._run is None:
            check_units(found)
        return found

    def _told(self, sample: Sample, report: Report) -> Report:
        """Return the report of a sample, after the fault twins are given both."""
        if self._fault_twins is not None:
            if report.change is not None:
                self._fault_twins.change(report.change)
            self._fault_twins.take(block_of([sample], self.plan.joints))
        return report

    @property
    def is_health_due(self) -> bool:
        """Return True if `update` left out the judgement of health for its last sample."""
        return self._compiled.is_due

    def judge_health(self) -> Health | None:
        """Judge the rig's health, if `update` left that out for its last sample; see `Report.health`."""
        return self._compiled.judge()

    def update_block(self, block: SampleBlock) -> list[ReportBlock | Report]:
        """Take the samples of a block in turn, as `update` does each of them, and raise as it does.

        Parameters
        ----------
        block : SampleBlock

        Returns
        -------
        list of ReportBlock or Report
            In the order of the samples: blocks of reports of regular samples, and a report of every other sample.
        """
        found: list[ReportBlock | Report] = []
        block = SampleBlock(*map(np.ascontiguousarray, block, (np.int64, np.int64, float)))
        row, size, channels, self._judged = 0, len(block.stamps), self._widths, True
        while row < size:
            if self._run is not None and self._edge.is_sure and not self.requests.due:
                end = row + CAPACITY
                if self._fault_twins is not None:  # they take a second before its verdict may be asked for
                    self._fault_twins.reach(int(block.stamps[row]), self._failing)
                    is_later = block.stamps[row:end] // SECOND != block.stamps[row] // SECOND
                    end = row + int(is_later.argmax()) if is_later.any() else end
                part = SampleBlock(block.streams[row:end], block.stamps[row:end], block.values[row:end])
                reason, done = self._compiled.advance(self._run, part)
                if done:
                    found += self._compiled.reports(part.stamps[:done])
                    if self._fault_twins is not None:
                        self._fault_twins.take(SampleBlock(part.streams[:done], part.stamps[:done], part.values[:done]))
                row += done
                if reason == DONE:
                    continue
                sample = self._sample(block, row, channels)
                found.append(self._told(sample, self._fail(sample, []) if reason == FAILED else self._look_at(sample)))
            else:
                found.append(self.update(self._sample(block, row, channels)))
            row += 1
        return found

    def _sample(self, block: SampleBlock, row: int, channels: list[int]) -> Sample:
        code = int(block.streams[row])
        return Sample(STREAMS[code], int(block.stamps[row]), block.values[row, : channels[code]].copy())
