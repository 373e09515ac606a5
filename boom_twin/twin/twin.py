"""The twin: samples of the rig in, predictions and residuals out. No ROS, no files, no clock."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..analysis.equilibrium import SHARE
from ..config.settings import Settings
from ..errors import BoomTwinError, SolverError, UsageError
from ..estimation.boom_predictor import BoomPredictor
from ..estimation.look_ahead import Tuning
from ..estimation.sensor_model import Mounting
from ..health.baseline import Baseline
from ..health.inference.block_problem import BlockProblem, MeasuredRows, PredictionRows
from ..health.monitor import HealthMonitor
from ..kernels.result_row import PIN
from ..kernels.tables import SENTENCES
from ..scene.edit import loaded
from ..scene.kinematics import stroke_curve
from ..scene.schema import Scene
from ..types import LIMIT, NANO, SECOND, Array, Change, Health, Mount, Outline, Report, Residuals, Sample, Stream, channels_of
from .adjustments import Requests, ResidualBuffer, SensorZeros
from .blocks import CODES, STREAMS, PredictionBlock, ReportBlock, ResidualBlock, SampleBlock
from .expected_readings import Deviations
from .sample_check import SHORTEST, SampleCheck
from .stamp_check import LASTING, StampCheck, TimeStep, explain, is_close, is_continuous, jerk_densities, largest_difference
from .state import (
    BEGINS_SLOT,
    EPOCH,
    IN_SLOT,
    IS_DEFLECTED,
    NEWEST,
    NONE,
    STATUS,
    STROKES,
    UNMATCHED,
    USUAL_STEP,
    Limits,
    TwinState,
    keep_waiting,
    new_output,
    new_state,
)  # fmt: skip
from .stroke_check import FAR, StrokeCheck
from .update import AFTER_PAUSE, DONE, FAILED, LOOK, ODD, REFRESH, matched, measure, update

EVENTS = {
    "late": "stamp not after the newest one of its stream; sample left out",
    "duplicate": "stamp as the newest one of its stream, within 20 us; sample left out",
    "partial": "some values missing, not finite or absurd; the others were used",
    "empty": "no usable value; sample left out",
    "waiting": "not all strokes known yet, or started less than a second ago; the model has not started",
    "gap": "longer pause between strokes, bridged",
    "restart": "pause too long to bridge, or strokes elsewhere after it; started again from rest",
    "leap": "stamp far from where its stream was; left out unless the next sample follows it",
    "clock set": "stamps went on elsewhere, strokes where they were; the model goes on, by the new stamps",
    "jump back": "time was set back, and strokes did not go on where they were; started again from rest",
    "second source": "samples of another source among those that are followed; left out",
    "implausible": "a stroke where its cylinder cannot be; left out unless the next ones agree",
    "out of range": "a stroke outside 0 to max_stroke of its cylinder; used where it is plausible",
    "held": "a stroke missing for long; taken to stay where it was",
    "model": "the model failed; it starts again with the next full sample",
    "reset": "asked for; the model started again from rest",
    "load": "payload or line fill changed; the model started again from rest",
    "limits": "other settings changed while the twin ran",
    "zero": "the zero of a sensor was set anew",
    "deflected": "tip further than half the boom's reach from the undeformed boom's: outside the model's validity",
    "unmatched": "no prediction at the stamp of this sample; no residual",
}

TOLD_AT_ONCE = frozenset({"restart", "clock set", "jump back", "reset", "load", "limits", "zero"})
"""Events that `Report.change` goes with."""

CAPACITY = 4096  # samples that one call of the compiled update takes at most


class _Run:
    """What the twin knows since the boom was last taken to be at rest, beside `TwinState`."""

    def __init__(self, state: TwinState, deviations: Deviations, stamp: int, is_again: bool) -> None:
        self.deviations, self.is_again, self._state = deviations, is_again, state
        self.plausible = StrokeCheck(state.clock)
        self.is_predicted = False
        state.clock[EPOCH] = state.clock[NEWEST] = stamp
        state.clock[IN_SLOT] = -1
        state.pace[:] = 0.0, 0.0, -math.inf
        state.past.bounds[:] = 0

    @property
    def epoch(self) -> int:
        """Stamp (ns) of the start."""
        return int(self._state.clock[EPOCH])

    @property
    def newest(self) -> int:
        """Stamp (ns) of the newest strokes that were followed."""
        return int(self._state.clock[NEWEST])

    @property
    def interval(self) -> float:
        """Running mean of the time between strokes, s."""
        return float(self._state.pace[USUAL_STEP])

    @property
    def strokes(self) -> Array:
        """The newest ones less their zeros, m, shape (n,); NaN where missing."""
        return self._state.strokes

    def strokes_at(self, stamp: int) -> Array | None:
        """As measured at `stamp` (ns), linear between samples, m, shape (n,); None where that is not remembered."""
        past = self._state.past
        row, share = matched(past, stamp)
        if row < 0:
            return None
        old = past.strokes[row - 1]
        return np.asarray(past.strokes[row] if share == 1.0 else old + share * (past.strokes[row] - old))

    def rebase(self, shift: int) -> None:
        """All stamps are later by `shift` (ns); what is remembered by stamps is forgotten."""
        self._state.clock[EPOCH] += shift
        self._state.clock[NEWEST] += shift
        self.deviations.rebase(shift)
        self._state.past.bounds[:] = 0


class Twin:
    """Follows a boom's strokes sample by sample.

    Parameters
    ----------
    scene : Scene
        The boom.
    settings : Settings, optional
        Noise of the sensors, tuning of the estimator, limits on time.
    mounts : sequence of Mount or None, optional
        Of every joint's angle sensor: None is an encoder of the joint (the default), else an inclinometer, see
        `boom_twin.estimation.sensor_model.Mounting`.
    baseline : Baseline, optional
        What model and sensors are off by while all is well. With it the rig's health is judged, see `Report.health`.
    on_block : callable, optional
        Is told every linear problem that health is judged by; a baseline is learnt from them.

    Attributes
    ----------
    mounts : tuple of Mount or None
        As given, one for every joint.
    counts : Counter
        How often each of `EVENTS` happened.
    requests : Requests
        What is asked while samples come: another load, other limits, a start from rest. It takes effect with the next full
        stroke sample, which `Report.change` tells.
    judge : HealthMonitor or None
        Of the rig's health; None without a baseline.

    Notes
    -----
    Everything predicted is a function of the accepted stroke samples alone; angle and IMU samples only give residuals, each
    against the prediction interpolated at its own stamp, in whatever order samples arrive.
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings | None = None,
        mounts: Sequence[Mount | None] = (),
        baseline: Baseline | None = None,
        on_block: Callable[[BlockProblem], object] | None = None,
    ) -> None:
        self._on_block = on_block
        self.scene, self.settings, self.baseline = scene, settings or Settings(), baseline
        self.counts: Counter[str] = Counter()
        self.mounts = tuple(mounts) or (None,) * len(scene.joints)
        self._channels = channels_of(len(scene.joints))
        self._counts = np.array([len(names) for names in self._channels.values()])
        self._state = new_state(len(scene.joints), self._counts)
        self._state.clock[NEWEST] = NONE
        self._beyond = FAR * self.settings.stroke_variance**0.5
        self._shortest = np.full(len(scene.joints), -self._beyond)
        self._longest = np.array([joint.cylinder.max_stroke for joint in scene.joints]) + self._beyond
        self._build()
        self._edge = SampleCheck(self._channels)
        self._run: _Run | None = None
        self._failed: int | None = None
        self._speeds: Array | None = None
        self._lines = self._new_lines()
        self.requests, self._zeros, self._recent = (
            Requests(self.settings),
            SensorZeros(self._state, self._channels),
            ResidualBuffer(self._state.recent, self._channels),
        )

    def _new_lines(self) -> dict[Stream, StampCheck]:
        return {stream: StampCheck(self.settings, self._state, CODES[stream]) for stream in Stream}

    def reset(self) -> None:
        """Forget all samples; the next full stroke sample starts from static equilibrium. Load, limits and zeros stay."""
        self._begin_anew()
        self._speeds = None
        self._lines = self._new_lines()
        self._state.waiting.bounds[:] = 0

    def rezero(self, sensor: str) -> dict[str, float]:
        """Ask that the mean residual of the last second becomes the zero of a sensor; gives its new zeros by channel.

        Parameters
        ----------
        sensor : str
            ``joint_i`` (rad), ``tip_imu`` (m/s^2, both axes), or ``cylinder_i`` (m). A stroke has no residual of its own:
            its zero becomes the one that explains the residual of ``joint_i``, which must read right for that; and the
            model, which the strokes drive, starts again from rest.

        Returns
        -------
        dict of str to float
            What its channels read too much, rad, m or m/s^2; it holds from the next full stroke sample on.

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

    def _build(self) -> None:
        """The model under the present load."""
        scene = loaded(self.scene, *self.settings.load)
        self._boom = BoomPredictor(scene)
        self.plan = self._boom.plan
        self.judge = None
        if self.baseline is not None:
            self.judge = HealthMonitor(scene, self.settings, self.mounts, self.baseline, self._on_block)
        self._limits, compiled = self._limited(SHARE * scene.reach), self._boom.compiled
        self._one = SampleBlock(np.zeros(1, np.int64), np.zeros(1, np.int64), np.full((1, self._counts.max()), np.nan))
        self._found = new_output(2 * CAPACITY, self.plan.joints, len(compiled.row), len(compiled.bending), self._counts)
        self._begin, self._told, self._news = (0, 0), (0, 0), NO_EXTRAS

    def _limited(self, valid: float) -> Limits:
        """What the compiled update judges by, under the present settings."""
        settings, counts = self.settings, self._counts
        mounting = Mounting(self.plan, self.scene.base.inclination, self.mounts)
        tuning = Tuning(
            settings.stroke_variance, settings.jerk_density, settings.lag, settings.step, settings.look_step, settings.rho
        )
        return Limits(
            tuning=tuning,
            patient=tuning._replace(lag=max(AFTER_PAUSE, settings.lag)),
            gap=round(settings.gap * SECOND),
            leap=settings.leap / NANO,
            far=self._beyond,
            rate=settings.stroke_rate,
            shortest=self._shortest,
            longest=self._longest,
            valid=valid,
            angle_variance=settings.angle_variance,
            gravity=np.array(self.plan.tables.gravity),
            inclination=self.scene.base.inclination,
            is_mounted=mounting.has_any,
            absolute=mounting.absolute,
            frames=mounting.frames,
            first=np.concatenate([[0], np.cumsum(counts[1:]) - counts[1:]]),
            channels=counts,
        )

    def _take_over(self, stamp: int) -> list[str]:
        """Make what was asked for hold; gives the events. Another load, or other zeros of strokes, need a start from rest."""
        asked, before = self.requests, self.settings
        from_rest, self.settings = asked.take(), asked.settings
        events = ["load"] if before.load != self.settings.load else []
        if before.limits != self.settings.limits:
            events.append("limits")
            self._limits = self._limited(self._limits.valid)
            for line in self._lines.values():
                line.tune(self.settings)
        if asked.zeros != self._zeros.values:
            events.append("zero")
            from_rest |= self._zeros.put(stamp, asked.zeros)
        if (from_rest or "load" in events) and self._run is not None:
            events += [] if events else ["reset"]
            self._begin_anew()
            keep_waiting(self._state, stamp, -NONE)
        if "load" in events:
            self._build()
        return events

    def _begin_anew(self) -> None:
        self._run = None
        self._state.clock[NEWEST] = NONE
        self._state.past.bounds[:] = 0
        self._zeros.forget_past()
        self._recent.clear()
        self._begin_health()

    def warm_up(self) -> None:
        """Compile every kernel, with a twin of the same boom that is thrown away."""
        other = Twin(self.scene, self.settings)
        middle = np.radians([sum(joint.range_deg) / 2 for joint in self.scene.joints])
        strokes = np.array([stroke_curve(self.scene, i, middle[i : i + 1])[0] for i in range(len(middle))])
        for k in range(20):
            other.update(Sample(Stream.STROKES, k * 5_000_000, strokes))
        other.update(Sample(Stream.ANGLES, 0, middle))
        other.update(Sample(Stream.STROKES, 7_000_000, strokes))  # a late one is looked up among those before

    def update(self, sample: Sample) -> Report:
        """Take one sample; see `Report` for what comes back. Whatever the rig measures, it never raises.

        Parameters
        ----------
        sample : Sample
            Values of one stream at one stamp, in the scene's order.

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
        sample = self._edge.checked(sample)
        if self._run is None or (self.requests.due and sample.stream is Stream.STROKES):
            return self._look_at(sample)
        self._fill_one(sample.stream, sample.stamp, sample.values)
        reason, _ = self._advance(self._one)
        if reason == DONE:
            return self._report(sample.stamp, [])
        return self._fail(sample, []) if reason == FAILED else self._look_at(sample)

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
        row, size, channels = 0, len(block.stamps), self._counts.tolist()
        while row < size:
            if self._run is not None and self._edge.is_sure and not self.requests.due:
                end = row + CAPACITY
                part = SampleBlock(block.streams[row:end], block.stamps[row:end], block.values[row:end])
                reason, done = self._advance(part)
                if done:
                    found += self._reports(part.stamps[:done])
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

    def _fill_one(self, stream: Stream, stamp: int, values: Array) -> None:
        one = self._one
        one.streams[0], one.stamps[0], one.values[0, : len(values)] = CODES[stream], stamp, values

    def _look_at(self, sample: Sample) -> Report:
        """Take a sample that may be out of the ordinary."""
        self._make_room()
        complete = _are_readings(sample.values.tolist())
        if not complete:
            usable = np.abs(sample.values) <= LIMIT
            if not usable.any():
                return self._refuse(sample, "empty")
            sample = replace(sample, values=np.where(usable, sample.values, np.nan))
        if sample.stream is Stream.STROKES:
            return self._take_strokes(sample, complete)
        return self._take_measured(sample, complete)

    # -- the compiled update ----------------------------------------------------------------------------------------

    def _advance(self, block: SampleBlock, trusted: bool = False) -> tuple[int, int]:
        """Take samples of a block as long as they are ordinary; why that ended, and how many they were.

        What they caused is in `_found` and `_news`. One sample that is `trusted` was looked at before.
        """
        found = self._found
        self._make_room()
        if len(block.stamps) == 1 and block.streams[0] != STROKES:
            args = int(block.streams[0]), int(block.stamps[0]), block.values[0]
            reason, row = (DONE, 1) if measure(self._limits, self._state, *args, trusted, found) else (ODD, 0)
        else:
            reason, row = self._advance_strokes(block, trusted)
        if unmatched := int(self._state.clock[UNMATCHED]):
            self.counts["unmatched"] += unmatched
            self._state.clock[UNMATCHED] = 0
        return reason, row

    def _make_room(self) -> None:
        """Before the next call of the compiled update, which adds its rows to those that the health monitor is told later."""
        self._begin, self._news = tuple(self._found.counts.tolist()), NO_EXTRAS
        if max(self._begin) > CAPACITY:
            self._tell_health()
            self._found.counts[:] = 0
            self._begin = self._told = 0, 0

    def _advance_strokes(self, block: SampleBlock, trusted: bool) -> tuple[int, int]:
        run, row, is_resumed, size = self._run, 0, False, len(block.stamps)
        assert run is not None
        while True:
            reason, row = update(*self._boom.compiled, self._limits, self._state, *block, row, is_resumed, trusted, self._found)
            if is_resumed := reason == REFRESH:
                interval = run.interval or self.settings.step
                run.deviations.refresh(self._boom.prediction(run.newest), interval, self._boom.live, self._boom.angles)
            elif reason != LOOK:
                return reason, row
            else:
                self._look_around(run, row)
                row += 1
                if row == size:
                    return DONE, row

    def _look_around(self, run: _Run, row: int) -> None:
        """What a prediction that begins a slot, or left the model's validity, has beside its numbers."""
        clock, at = self._state.clock, int(self._found.counts[0]) - 1 - self._begin[0]
        if self._news is NO_EXTRAS:
            self._news = _UpdateExtras()
        news = self._news
        if clock[IS_DEFLECTED]:
            news.deflected.add(row)
            self.counts["deflected"] += 1
        if not clock[BEGINS_SLOT]:
            return
        news.outlines[at] = self._boom.outline()
        if self.judge is not None:
            self._tell_health()
            health = self.judge.judge(run.newest, self._boom.variances, run.deviations.noise, run.deviations.tip)
            if health is not None:
                news.health[row] = health

    def _tell_health(self) -> None:
        """Give the health monitor what has come since it was told last."""
        found, at = self._found, self._boom.places
        if self.judge is None:
            return
        new, last = (slice(told, count) for told, count in zip(self._told, found.counts.tolist(), strict=True))
        if new.stop > new.start:
            rows = found.rows[new].copy()
            acceleration = rows[:, at.tip].reshape(-1, 3, 3)[:, 2, :2]
            followed = PredictionRows(
                found.stamps[new].copy(), found.measured[new].copy(), rows[:, at.strokes], rows[:, at.joints], acceleration
            )
            self.judge.predicted(followed)
        if last.stop > last.start:
            streams = found.residual_streams[last]
            for code in sorted(set(streams.tolist())):
                own, width = np.flatnonzero(streams == code) + last.start, int(self._counts[code])
                self.judge.measured(
                    STREAMS[code], MeasuredRows(found.residual_stamps[own], found.raw[own, :width], found.values[own, :width])
                )
        self._told = new.stop, last.stop

    def _residuals(self) -> ResidualBlock:
        found, own = self._found, slice(self._begin[1], int(self._found.counts[1]))
        return ResidualBlock(
            at=found.residual_at[own].copy(),
            streams=found.residual_streams[own].copy(),
            stamps=found.residual_stamps[own].copy(),
            values=found.values[own].copy(),
            sigmas=found.sigmas[own].copy(),
        )

    def _predictions(self) -> PredictionBlock:
        found, own, at = self._found, slice(self._begin[0], int(self._found.counts[0])), self._boom.places
        rows = found.rows[own].copy()
        tip = rows[:, at.tip].reshape(-1, 3, 3)
        return PredictionBlock(
            at=found.at[own].copy(),
            stamps=found.stamps[own].copy(),
            tip_position=tip[:, 0, :2],
            tip_displacement=tip[:, 0, :2] - rows[:, at.rigid_tip],
            tip_velocity=tip[:, 1, :2],
            tip_acceleration=tip[:, 2, :2],
            tip_angle=tip[:, 0, 2],
            tip_angular_velocity=tip[:, 1, 2],
            tip_angular_acceleration=tip[:, 2, 2],
            joints=rows[:, at.joints],
            strokes=rows[:, at.strokes],
            cylinder_forces=rows[:, at.cylinder_forces],
            clearances=rows[:, at.pins].reshape(len(rows), len(self.plan.pins), PIN),
            moments=found.moments[own].copy(),
            outlines=self._news.outlines,
        )

    def _reports(self, stamps: NDArray[np.int64]) -> list[ReportBlock | Report]:
        """What the compiled update found of samples with these stamps (ns)."""
        block = ReportBlock(stamps, self._predictions(), self._residuals(), self._news.health)
        if not self._news.deflected:
            return [block]
        reports = enumerate(block.reports(self.plan.joints))
        return [replace(each, events=("deflected",)) if row in self._news.deflected else each for row, each in reports]

    def _report(self, stamp: int, events: list[str]) -> Report:
        """What the compiled update found of one sample, of which `events` are to be told too."""
        found, news, (predicted, known) = self._found, self._news, self._found.counts.tolist()
        residuals = []
        for row in range(self._begin[1], known):
            stream = STREAMS[found.residual_streams[row]]
            names = self._channels[stream]
            values, sigmas = found.values[row, : len(names)].copy(), found.sigmas[row, : len(names)].copy()
            residuals.append(Residuals(stream, int(found.residual_stamps[row]), names, values, sigmas))
        if predicted == self._begin[0]:
            return Report(stamp, True, residuals=tuple(residuals), events=tuple(events))
        prediction = self._boom.prediction(stamp, news.outlines.get(0))
        told = (*events, "deflected") if news.deflected else tuple(events)
        passes = int(found.passes[predicted - 1])
        return Report(stamp, True, prediction, tuple(residuals), told, passes=passes, health=news.health.get(0))

    # -- strokes ----------------------------------------------------------------------------------------------------

    def _take_strokes(self, sample: Sample, complete: bool) -> Report:
        line, run, values = self._lines[Stream.STROKES], self._run, self._zeroed(sample)
        if run is None:
            return self._follow(sample, values, complete, [])
        span = sample.stamp - run.newest
        if line.is_next(sample.stamp) and span >= SHORTEST:
            if run.plausible.is_of_others(sample.stamp - run.epoch, values, self._boom.estimate, self.settings):
                self.counts["implausible"] += 1
                return Report(sample.stamp, True, events=("implausible",))
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
        if why is TimeStep.NEITHER and not line.is_confirmed(LASTING if is_young or line.is_second else gap):
            return self._hold(sample, event)
        return self._step_in_time(run, line, why)

    def _is_apart(self, line: StampCheck, sample: Sample) -> bool:
        """Whether no cylinder is so fast as to come here from the strokes that are held."""
        if not line.held:
            return False
        last = line.held[-1][0]
        way = self._beyond + self.settings.stroke_rate * abs(sample.stamp - last.stamp) * NANO
        return bool(largest_difference(sample.values, last.values) > way)

    def _is_late(self, run: _Run, stamp: int, values: Array) -> bool:
        """Whether it is back by little, and its strokes are those of its stamp."""
        if not -self.settings.jump_back <= (stamp - run.newest) * NANO < 0.0:
            return False
        then = run.strokes_at(stamp)
        return then is None or is_close(values, then, run.interval, self.settings)

    def _explain(self, run: _Run, line: StampCheck) -> TimeStep:
        """Why the stamps of what is held are not those that were to come."""
        (first, _), (later, _) = line.held[:2]
        values = self._zeroed(first), self._zeroed(later)
        span, apart = (first.stamp - run.newest) * NANO, (later.stamp - first.stamp) * NANO
        return explain(self._boom, run.strokes, values, span, apart, line.usual * NANO or apart, self.settings)

    def _step_in_time(self, run: _Run, line: StampCheck, why: TimeStep) -> Report:
        """Follow the samples that were held, now that the newest confirms them."""
        held, usual = self._released(line), round(line.usual)
        span = held[0].stamp - run.newest
        events = ["gap"] if span * NANO > self.settings.gap else []
        if why is TimeStep.CLOCK:
            events = ["clock set"]
            self._rebase(run, span - usual)
        elif why is TimeStep.NEITHER:
            events = ["restart" if span > 0 else "jump back"]
            speeds = self._speeds_of(held)
            self.reset()
            self._speeds = speeds
        elif events:
            self._doubt_pause(run, held[0], why)
        reports = []
        for sample in held:
            complete = bool(np.isfinite(sample.values.sum()))
            reports.append(self._follow(sample, self._zeroed(sample), complete, events))
            events = []
        return replace(reports[-1], earlier=tuple(reports[:-1]))

    def _doubt_pause(self, run: _Run, first: Sample, why: TimeStep) -> None:
        """State what the model cannot know after a pause that ended with the sample `first`."""
        span = (first.stamp - run.newest) * NANO
        run.deviations.add_pause(first.stamp, span, jerk_densities(self._boom, self._zeroed(first), span, self.settings))
        if why is TimeStep.EITHER:
            run.deviations.add_phase(first.stamp, self._boom.prediction(run.newest))

    def _speeds_of(self, held: list[Sample]) -> Array:
        """Of strokes (m/s) around a start from rest: before it as estimated, after it as measured, whichever is larger."""
        before, (first, last) = np.abs(self._boom.speeds), (held[0], held[-1])
        after = np.abs(last.values - first.values) / ((last.stamp - first.stamp) * NANO)
        return np.asarray(np.fmin(np.fmax(before, after), self.settings.stroke_rate))

    def _released(self, line: StampCheck) -> list[Sample]:
        """Samples that were held; what those before the newest were told to be counts no more."""
        held = line.release()
        self.counts.subtract(event for _, event in held[:-1])
        for event in {event for _, event in held if not self.counts[event]}:
            del self.counts[event]
        return [sample for sample, _ in held]

    def _rebase(self, run: _Run, shift: int) -> None:
        """Stamps are later by `shift` (ns) from now on, and the model goes on."""
        before = run.newest
        run.rebase(shift)
        for line in self._lines.values():
            line.newest = None
        self._zeros.forget_past()
        self._recent.clear()
        if shift < 0:
            keep_waiting(self._state, NONE, before)
        self._begin_health()

    def _begin_health(self) -> None:
        """What was found up to now is of no concern to the health monitor any more."""
        self._told = tuple(self._found.counts.tolist())
        if self.judge is not None:
            self.judge.begin()

    def _zeroed(self, sample: Sample) -> Array:
        """Strokes without what their sensors read too much."""
        return sample.values - self._zeros.of_strokes(sample.stamp)

    def _follow(self, sample: Sample, values: Array, complete: bool, events: list[str]) -> Report:
        """Go on to a stroke sample, whose `values` are without the sensors' zeros; the model starts if it has not."""
        if not complete:
            events.append("partial")
        asked = complete and self.requests.due
        if asked:
            events += self._take_over(sample.stamp)
            values = self._zeroed(sample)
        told = asked or "clock set" in events
        if ((values < self._shortest) | (values > self._longest)).any():
            events.append("out of range")
        sample = replace(sample, values=values)
        if self._run is not None:
            report, from_rest = self._step(self._run, sample, events), False
        elif complete and (self._failed is None or asked or abs(sample.stamp - self._failed) >= LASTING):
            report, from_rest = self._start(sample, events), True
        else:
            return self._refuse(sample, "waiting", *events)
        if told or (from_rest and report.accepted):
            return replace(report, change=Change(sample.stamp, from_rest, self.settings.live, self._zeros.values))
        return report

    def _start(self, sample: Sample, events: list[str]) -> Report:
        try:
            self._boom.start(sample.values)
        except BoomTwinError as error:
            self._failed = sample.stamp if isinstance(error, SolverError) else self._failed
            return self._refuse(sample, "model", *events, status=str(error))
        speeds, self._speeds = self._speeds, None
        deviations = Deviations(self.plan, self.settings, self._state, sample.stamp, speeds)
        self._run = _Run(self._state, deviations, sample.stamp, speeds is not None)
        return self._step(self._run, sample, events)

    def _step(self, run: _Run, sample: Sample, events: list[str]) -> Report:
        """Step the model to strokes that were looked at, their values less the sensors' zeros."""
        self._lines[Stream.STROKES].take(sample.stamp)
        estimate = self._boom.estimate if run.is_predicted else None
        taken, oddities = run.plausible.of(sample.stamp - run.epoch, sample.values, estimate, self.settings)
        run.is_predicted = True
        events += oddities
        self._state.strokes[:], self._state.taken[:] = sample.values, taken
        self._fill_one(sample.stream, sample.stamp, sample.values)
        reason, _ = self._advance(self._one, trusted=True)
        if reason == FAILED:
            return self._fail(sample, events)
        self.counts.update(events)
        return self._report(sample.stamp, events)

    def _fail(self, sample: Sample, events: list[str]) -> Report:
        """The model failed at a stroke sample."""
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
        reports = [self._compare(each, bool(np.isfinite(each.values.sum()))) for each in self._released(line)]
        return replace(reports[-1], earlier=tuple(reports[:-1]))

    def _compare(self, sample: Sample, complete: bool) -> Report:
        """Residuals of a measured sample, now or when the strokes have come."""
        self._lines[sample.stream].take(sample.stamp)
        events: tuple[str, ...] = ()
        if not complete:
            events = ("partial",)
            self.counts.update(events)
        self._fill_one(sample.stream, sample.stamp, sample.values)
        reason, _ = self._advance(self._one, trusted=True)
        if reason != DONE:
            return self._refuse(sample, "unmatched", *events)
        return self._report(sample.stamp, list(events))

    def _hold(self, sample: Sample, event: str) -> Report:
        """Taken as a witness of time alone, at first."""
        self.counts[event] += 1
        return Report(sample.stamp, True, events=(event,))

    def _refuse(self, sample: Sample, *events: str, status: str = "ok") -> Report:
        self.counts.update(events)
        return Report(sample.stamp, False, events=events, status=status)


@dataclass
class _UpdateExtras:
    """What one call of the compiled update gives beside numbers.

    outlines by row of a prediction, health by row of a sample, deflected: rows of samples.
    """

    outlines: dict[int, Outline] = field(default_factory=dict)
    health: dict[int, Health] = field(default_factory=dict)
    deflected: set[int] = field(default_factory=set)


NO_EXTRAS = _UpdateExtras()


def _are_readings(values: list[float]) -> bool:
    """Whether none is missing, not finite or absurd."""
    return math.isfinite(sum(values)) and max(map(abs, values)) <= LIMIT
