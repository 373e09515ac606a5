"""The twin: samples of the rig in, predictions and residuals out. No ROS, no files, no clock."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from ..config.settings import Settings
from ..errors import BoomTwinError, SolverError, UsageError
from ..health.baseline import Baseline
from ..health.monitor import warm_up
from ..kernels.tables import SENTENCES
from ..scene.kinematics import strokes_of_angles
from ..scene.load import SceneSource, as_scene
from ..types import LIMIT, NANO, Array, Change, Health, Mount, Report, Sample, Stream, StrokeReading, channels_of
from .adjustments import Requests, ResidualBuffer, SensorZeros
from .block_update import CAPACITY, BlockUpdate, limits_of
from .blocks import CODES, STREAMS, ReportBlock, SampleBlock
from .load_shedding import LoadShedding
from .loaded_model import LoadedModel, loaded_model
from .run import Run
from .sample_check import SHORTEST, SampleCheck
from .stamp_check import (
    LASTING,
    StampCheck,
    TimeStep,
    explain,
    is_close,
    is_continuous,
    largest_difference,
)
from .state import NEWEST, NONE, STATUS, UNMATCHED, drop_waiting, new_state
from .update import DONE, FAILED


class Twin:
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
    baseline : Baseline, optional
        With it the rig's health is judged, see `Report.health`.
    reads : StrokeReading
        What the stroke transducers read: the lengths of the cylinders, oil compressed, or, of sessions that were made before
        version 0.2.0, their drives.
    absent : collection of str
        Channels without a sensor, such as ``joint_3``: no reading of them is missed.
    doubted : collection of str
        Channels of angle sensors and of the IMU whose zeros may drift by any amount.

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
        Of the rig's health; None without a baseline.

    Notes
    -----
    Everything predicted is a function of the accepted stroke samples alone; all other samples only give residuals, each
    against the prediction interpolated at its own stamp, in whatever order samples arrive.
    """

    def __init__(
        self,
        scene: SceneSource = None,
        settings: Settings | None = None,
        mounts: Sequence[Mount | None] = (),
        baseline: Baseline | None = None,
        reads: StrokeReading = StrokeReading.LENGTH,
        absent: Collection[str] = (),
        doubted: Collection[str] = (),
    ) -> None:
        self.reads, self.absent, scene = reads, frozenset(absent), as_scene(scene)
        self.scene, self.settings, self.baseline = scene, settings or Settings(), baseline
        self.counts: Counter[str] = Counter()
        self.shedding = LoadShedding()
        self.mounts = tuple(mounts) or (None,) * len(scene.joints)
        self._channels = channels_of(len(scene.joints))
        self._there = {s: np.array([name not in absent for name in names]) for s, names in self._channels.items()}
        self._widths = [len(names) for names in self._channels.values()]
        self._edge = SampleCheck(self._channels)
        self.requests = Requests(self.settings)
        self._doubted = frozenset(doubted)
        self._judged = True  # health, with the present sample
        self._begin()

    def _begin(self) -> None:
        """Reset state, model, estimate, health and zeros to those before the first sample."""
        self._state = new_state(len(self.scene.joints), np.array(self._widths))
        self._state.clock[NEWEST] = NONE
        self._adopt(self.model(self.settings))
        self._run: Run | None = None
        self._is_new = True
        self._failed: int | None = None
        self._lines = self._new_lines()
        self._zeros = SensorZeros(self._state, self._channels)
        self._recent = ResidualBuffer(self._state.recent, self._channels)

    def __repr__(self) -> str:
        return f"Twin({self.scene!r}; {len(self.mounts)} joints; {dict(self.counts) or 'nothing odd yet'})"

    def _new_lines(self) -> dict[Stream, StampCheck]:
        return {stream: StampCheck(self.settings, self._state, CODES[stream]) for stream in Stream}

    def reset(self) -> None:
        """Forget all samples; the next full stroke sample starts from static equilibrium. Load, limits and zeros stay."""
        self._begin_anew()
        self._lines = self._new_lines()
        self._state.waiting.bounds[:] = 0

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
        if kind == "cylinder" and self.mounts[int(number) - 1] is not None:
            told = f"{sensor}: joint_{number} has an inclinometer, which feels every joint inboard"
            raise UsageError(f"{told}. Set the zero of {sensor} in the mapping.")
        if self._run is None:
            raise UsageError(f"{sensor}: nothing is predicted yet. Let the strokes come first.")
        found = self._recent.zeros_of(sensor, self._run.newest, self._zeros.values, self._boom.slope)
        self.requests.zero(found)
        return found

    def model(self, settings: Settings) -> LoadedModel:
        """Return the model under the load of `settings`; another thread may call this, since the twin keeps its own model.

        Parameters
        ----------
        settings : Settings

        Returns
        -------
        LoadedModel
            What `ModelPreparation` gives to `requests.tune`.

        Raises
        ------
        UsageError
            The load cannot be.
        """
        self._former: BlockUpdate | None = None
        return loaded_model(self.scene, settings, self.mounts, self.baseline, self.reads, self.absent)

    def _adopt(self, model: LoadedModel, before: BlockUpdate | None = None) -> None:
        """Use this model, which has the present load, in place of that of `before`."""
        self._boom, self.judge = model.boom, model.judge
        self._boom.doubt(self._doubted)
        self.plan = self._boom.plan
        parts = self._boom, model.limits, self._state, self._channels, self.judge
        self._former = before  # let go of when the next model is made, which may be in a thread of its own
        self._compiled = BlockUpdate(*parts, self.counts, self.shedding, before)
        self._one = SampleBlock(np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros((1, self.plan.joints)))  # of strokes

    def _take_over(self, stamp: int) -> list[str]:
        """Apply the requested changes; return the events. Another load, or other zeros of strokes, need a start from rest."""
        asked, before = self.requests, self.settings
        model, is_new = asked.model, asked.is_new and self._run is not None
        from_rest, self.settings = asked.take(), asked.settings
        if is_new:
            self._begin()
            before = self.settings
        events = ["load"] if before.load != self.settings.load else []
        if before.limits != self.settings.limits:
            events.append("limits")
            self._compiled.limits = limits_of(self.scene, self._boom, self.settings, self.absent)
            for line in self._lines.values():
                line.tune(self.settings)
        if asked.zeros != self._zeros.values:
            events.append("zero")
            from_rest |= self._zeros.put(stamp, asked.zeros)
        if (from_rest or "load" in events) and self._run is not None:
            events += [] if events else ["reset"]
            self._begin_anew_at(stamp)
        if "load" in events:
            self._adopt(model or self.model(self.settings), self._compiled)
        return events

    def _begin_anew_at(self, stamp: int) -> None:
        """Start from rest with the strokes of `stamp` (ns), though the boom may be moving; measured samples since then wait."""
        self._begin_anew()
        drop_waiting(self._state, NONE, stamp - 1)

    def _begin_anew(self) -> None:
        self._run = None
        self._state.clock[NEWEST] = NONE
        self._state.past.bounds[:] = 0
        self._zeros.forget_past()
        self._recent.clear()
        self._compiled.begin_health()

    def warm_up(self) -> None:
        """Compile every kernel, with a temporary twin of the same boom."""
        other = Twin(self.scene, self.settings, reads=self.reads)
        middle = np.radians([sum(joint.range_deg) / 2 for joint in self.scene.joints])
        strokes = strokes_of_angles(self.scene, middle)
        for k in range(20):
            other.update(Sample(Stream.STROKES, k * 5_000_000, strokes))
        other.update(Sample(Stream.ANGLES, 0, middle))
        other.update(Sample(Stream.STROKES, 7_000_000, strokes))  # a late one is looked up among those before
        if self.judge is not None:
            warm_up()

    def update(self, sample: Sample, judged: bool = True) -> Report:
        """Take one sample; see `Report` for what comes back. Whatever the rig measures, it never raises.

        Parameters
        ----------
        sample : Sample
            Values of one stream at one stamp, in the scene's order.
        judged : bool
            With the judgement of the rig's health, where that is due. Without it the rest comes sooner, and `judge_health`
            is to be called next.

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
        sample, self._judged = self._edge.checked(sample), judged
        if self._run is None or (self.requests.due and sample.stream is Stream.STROKES):
            return self._look_at(sample)
        reason = self._advance_one(sample)
        if reason == DONE:
            return self._compiled.report(sample.stamp, (), judged)
        return self._fail(sample, []) if reason == FAILED else self._look_at(sample)

    @property
    def is_health_due(self) -> bool:
        """Return True if `update` left out the judgement of health for its last sample."""
        return self._compiled.is_due

    def judge_health(self) -> Health | None:
        """Judge the rig's health, if `update` left that out for its last sample; see `Report.health`."""
        return self._compiled.judge()

    def update_block(self, block: SampleBlock) -> list[ReportBlock | Report]:
        """Take the samples of a block in turn, as `update` does each of them.

        Parameters
        ----------
        block : SampleBlock

        Returns
        -------
        list of ReportBlock or Report
            In the order of the samples: blocks of those of which nothing out of the ordinary is to be told, and a report of
            every other sample.

        Raises
        ------
        UsageError
            As `update` does; the samples before have been taken.
        """
        found: list[ReportBlock | Report] = []
        block = SampleBlock(*map(np.ascontiguousarray, block, (np.int64, np.int64, float)))
        if not self._edge.is_sure:
            self._edge.look_at(block.stamps[block.streams == CODES[Stream.STROKES]])
        row, size, channels, self._judged = 0, len(block.stamps), self._widths, True
        while row < size:
            if self._run is not None and self._edge.is_sure and not self.requests.due:
                end = row + CAPACITY
                part = SampleBlock(block.streams[row:end], block.stamps[row:end], block.values[row:end])
                reason, done = self._compiled.advance(self._run, part)
                if done:
                    found += self._compiled.reports(part.stamps[:done])
                row += done
                if reason == DONE:
                    continue
                sample = self._sample(block, row, channels)
                found.append(self._fail(sample, []) if reason == FAILED else self._look_at(sample))
            else:
                found.append(self.update(self._sample(block, row, channels)))
            row += 1
        return found

    def _sample(self, block: SampleBlock, row: int, channels: list[int]) -> Sample:
        code = int(block.streams[row])
        return Sample(STREAMS[code], int(block.stamps[row]), block.values[row, : channels[code]].copy())

    def _advance_one(self, sample: Sample, trusted: bool = False) -> int:
        """Take a sample if it is regular, or `trusted`; see `BlockUpdate.advance`."""
        if sample.stream is not Stream.STROKES:
            return self._compiled.measure(CODES[sample.stream], sample.stamp, sample.values, trusted)
        one = self._one
        one.stamps[0], one.values[0] = sample.stamp, sample.values
        reason, _ = self._compiled.advance(self._run, one, trusted)
        return reason

    def _look_at(self, sample: Sample) -> Report:
        """Take a sample that may be irregular. It is copied, since it may be held and the caller's arrays may change."""
        self._compiled.make_room()
        sample = replace(sample, values=sample.values.copy())
        complete = self._is_complete(sample)
        if not complete:
            usable = np.abs(sample.values) <= LIMIT
            if not usable.any():
                return self._refuse(sample, "empty")
            sample = replace(sample, values=np.where(usable, sample.values, np.nan))
        if sample.stream is Stream.STROKES:
            return self._take_strokes(sample, complete)
        return self._take_measured(sample, complete)

    # -- the compiled update ----------------------------------------------------------------------------------------

    # -- strokes ----------------------------------------------------------------------------------------------------

    def _take_strokes(self, sample: Sample, complete: bool) -> Report:
        line, run, values = self._lines[Stream.STROKES], self._run, self._zeroed(sample)
        if run is None:
            return self._follow(sample, values, complete, [])
        span = sample.stamp - run.newest
        if line.is_next(sample.stamp) and span >= SHORTEST:
            if run.plausible.is_of_others(sample.stamp - run.epoch, values, self._boom.estimate, self.settings):
                return self._refuse(sample, "implausible")
            return self._follow(sample, values, complete, [])
        if 0 <= span < SHORTEST:
            same = is_close(values, run.strokes, 0.0, self.settings)
            return self._refuse(sample, "duplicate" if same else "second source")
        if line.is_soon(sample.stamp) and is_continuous(self._boom, run.strokes, values, span * NANO, 0.0, self.settings):
            return self._follow(sample, values, complete, [])
        then = run.strokes_at(sample.stamp)
        back = (run.newest - sample.stamp) * NANO
        if then is not None and back <= self.settings.jump_back and np.array_equal(then, values):
            return self._refuse(sample, "late")
        is_late = self._is_late(run, sample.stamp, values)
        event = line.hold(sample, "late" if is_late else "leap", self._is_apart(line, sample))
        gap = self.settings.gap / NANO
        if not line.is_confirmed(gap if is_late or line.is_second else 0.0):
            return self._hold(sample, event)
        why = self._explain(run, line)
        is_young = run.is_again and run.newest - run.epoch < LASTING
        is_in_time = 0 < line.held[0][0].stamp - run.newest <= gap  # no clock and no pause: all strokes jumped at once
        is_odd = is_young or is_in_time or line.is_second
        if why is TimeStep.NEITHER and not line.is_confirmed(LASTING if is_odd else gap):
            return self._hold(sample, event)
        return self._step_in_time(run, line, why)

    def _is_apart(self, line: StampCheck, sample: Sample) -> bool:
        """Return True if some cylinder could not have reached these strokes from the held ones at its maximum speed."""
        if not line.held:
            return False
        last = line.held[-1][0]
        way = self._compiled.limits.far + self.settings.stroke_rate * abs(sample.stamp - last.stamp) * NANO
        return bool(largest_difference(sample.values, last.values) > way)

    def _is_late(self, run: Run, stamp: int, values: Array) -> bool:
        """Return True if the stamp is back by at most `jump_back` and the strokes agree with those of that time."""
        if not -self.settings.jump_back <= (stamp - run.newest) * NANO < 0.0:
            return False
        then = run.strokes_at(stamp)
        return then is None or is_close(values, then, run.interval, self.settings)

    def _explain(self, run: Run, line: StampCheck) -> TimeStep:
        """Return the reason why the stamps of the held samples step."""
        (first, _), (later, _) = line.held[:2]
        values = self._zeroed(first), self._zeroed(later)
        span, apart = (first.stamp - run.newest) * NANO, (later.stamp - first.stamp) * NANO
        return explain(self._boom, run.strokes, values, span, apart, line.usual * NANO or apart, self.settings)

    def _step_in_time(self, run: Run, line: StampCheck, why: TimeStep) -> Report:
        """Follow the samples that were held, now that the newest confirms them."""
        held, usual = self._released(line), round(line.usual)
        span = held[0].stamp - run.newest
        events = ["gap"] if span * NANO > self.settings.gap else []
        if why is TimeStep.CLOCK:
            events = ["clock set"]
            self._rebase(run, span - usual)
        elif why is TimeStep.NEITHER:
            events = ["restart" if span > 0 else "jump back"]
            self.reset()
        elif events and why is TimeStep.EITHER:
            self._boom.add_phase(self._boom.prediction(run.newest))
        reports, asked = [], self._judged
        for sample in held:
            complete, self._judged = self._is_complete(sample), asked or sample is not held[-1]
            reports.append(self._follow(sample, self._zeroed(sample), complete, events))
            events = []
        return replace(reports[-1], earlier=tuple(reports[:-1]))

    def _released(self, line: StampCheck) -> list[Sample]:
        """Return the held samples; events counted for those before the newest are uncounted."""
        held = line.release()
        self.counts.subtract(event for _, event in held[:-1])
        for event in {event for _, event in held if not self.counts[event]}:
            del self.counts[event]
        return [sample for sample, _ in held]

    def _rebase(self, run: Run, shift: int) -> None:
        """Shift stamps by `shift` (ns) from now on; the model continues."""
        before = run.newest
        run.rebase(shift)
        self._boom.rebase(shift)
        for line in self._lines.values():
            line.newest = None
        self._zeros.forget_past()
        self._recent.clear()
        if shift < 0:
            drop_waiting(self._state, before + 1, -NONE)
        self._compiled.begin_health()

    def _zeroed(self, sample: Sample) -> Array:
        """Return strokes less their zeros."""
        return sample.values - self._zeros.of_strokes(sample.stamp)

    def _follow(self, sample: Sample, values: Array, complete: bool, events: list[str]) -> Report:
        """Step to a stroke sample, whose `values` are without the sensors' zeros; start the model if it has not started."""
        if not complete:
            events.append("partial")
        asked = complete and self.requests.due
        if asked:
            events += self._take_over(sample.stamp)
            values = self._zeroed(sample)
        told = asked or "clock set" in events
        limits = self._compiled.limits
        if ((values < limits.shortest) | (values > limits.longest)).any():
            events.append("out of range")
        sample = replace(sample, values=values)
        if self._run is not None:
            report, from_rest = self._step(self._run, sample, events), False
        elif complete and (self._failed is None or asked or abs(sample.stamp - self._failed) >= LASTING):
            report, from_rest = self._start(sample, events), True
        else:
            return self._refuse(sample, "waiting", *events)
        if told or (from_rest and report.accepted):
            is_new = from_rest and self._is_new
            if from_rest and report.accepted:
                self._is_new = False
            return replace(report, change=Change(sample.stamp, from_rest, self.settings.live, self._zeros.values, is_new))
        return report

    def _start(self, sample: Sample, events: list[str]) -> Report:
        try:
            self._boom.start(sample.values, not self._is_new)
        except BoomTwinError as error:
            self._failed = sample.stamp if isinstance(error, SolverError) else self._failed
            return self._refuse(sample, "model", *events, status=str(error))
        self._run = Run(self._state, sample.stamp, not self._is_new)
        return self._step(self._run, sample, events)

    def _step(self, run: Run, sample: Sample, events: list[str]) -> Report:
        """Step the model to checked strokes, their values less the sensors' zeros."""
        self._lines[Stream.STROKES].take(sample.stamp)
        estimate = self._boom.estimate if run.is_predicted else None
        before, rates, check = self._state.strokes, self._boom.speeds, run.plausible
        taken, oddities = check.of(sample.stamp - run.epoch, sample.values, before, estimate, rates, self.settings)
        if check.must_restart and np.isfinite(sample.values).all():
            self._begin_anew_at(sample.stamp)
            return self._follow(sample, sample.values, True, [*events, "stroke elsewhere"])
        run.is_predicted = True
        events += oddities
        self._state.strokes[:], self._state.taken[:] = sample.values, taken
        if self._advance_one(sample, trusted=True) == FAILED:
            return self._fail(sample, events)
        self.counts.update(events)
        return self._compiled.report(sample.stamp, events, self._judged)

    def _fail(self, sample: Sample, events: list[str]) -> Report:
        """Return the report of a stroke sample at which the model failed; reset the model."""
        self.reset()
        self._failed = sample.stamp
        return self._refuse(sample, "model", *events, status=SENTENCES[int(self._state.clock[STATUS])])

    # -- measured angles and accelerations ----------------------------------------------------------------------------

    def _take_measured(self, sample: Sample, complete: bool) -> Report:
        line = self._lines[sample.stream]
        longest = line.longest if line.usual else self.settings.leap / NANO
        if line.newest is None or 0 < sample.stamp - line.newest <= longest:
            return self._compare(sample, complete)
        span = (sample.stamp - line.newest) * NANO
        if -self.settings.jump_back <= span <= 0.0:
            return self._refuse(sample, "duplicate" if span == 0.0 else "late")
        event = line.hold(sample, "leap")
        if not line.is_confirmed():
            return self._hold(sample, event)
        held = self._released(line)
        gone = drop_waiting(self._state, held[0].stamp, -NONE, CODES[sample.stream])  # their time comes again: a looped bag
        self._state.clock[UNMATCHED] += gone
        reports = [self._compare(each, self._is_complete(each)) for each in held]
        return replace(reports[-1], earlier=tuple(reports[:-1]))

    def _compare(self, sample: Sample, complete: bool) -> Report:
        """Take a measured sample and return its report; its residuals come now or once its strokes have come."""
        self._lines[sample.stream].take(sample.stamp)
        events: tuple[str, ...] = ()
        if not complete:
            events = ("partial",)
            self.counts.update(events)
        if self._advance_one(sample, trusted=True) != DONE:
            return self._refuse(sample, "unmatched", *events)
        return self._compiled.report(sample.stamp, events)

    def _hold(self, sample: Sample, event: str) -> Report:
        """Count an event and return the report of a held sample; its values are not used for now."""
        self.counts[event] += 1
        return Report(sample.stamp, True, events=(event,))

    def _refuse(self, sample: Sample, *events: str, status: str = "ok") -> Report:
        self.counts.update(events)
        return Report(sample.stamp, False, events=events, status=status)

    def _is_complete(self, sample: Sample) -> bool:
        """Return True if no sensor's reading is missing, not finite or absurd."""
        return bool((np.abs(sample.values) <= LIMIT)[self._there[sample.stream]].all())
