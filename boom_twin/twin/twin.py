"""The twin: samples of the rig in, predictions and residuals out. No ROS, no files, no clock."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from operator import gt, lt

import numpy as np

from ..analysis.equilibrium import SHARE
from ..config.settings import Settings
from ..errors import BoomTwinError, SolverError, UsageError
from ..estimation.boom_predictor import BoomPredictor
from ..estimation.sensor_model import Mounting
from ..health.baseline import Baseline
from ..health.inference.block_problem import BlockProblem
from ..health.monitor import HealthMonitor
from ..kernels.tables import OK, SENTENCES
from ..scene.edit import loaded
from ..scene.kinematics import stroke_curve
from ..scene.schema import Scene
from ..types import LIMIT, NANO, Array, Change, Mount, Prediction, Report, Residuals, Sample, Stream, channels_of
from .adjustments import Requests, ResidualBuffer, SensorZeros
from .expected_readings import Deviations, PredictedBoom, PredictionBuffer, expected_readings
from .sample_check import SHORTEST, SampleCheck
from .stamp_check import LASTING, StampCheck, TimeStep, explain, goes_on, is_close, jerk_densities, surprise
from .stroke_check import FAR, StrokeCheck

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

SMOOTHING = 0.05  # weight of the newest interval in the running mean
PENDING = 4096  # most samples that wait for a stroke
SHAPE_PERIOD = 100_000_000  # ns of one slot; one shape is given in each, 10 a second


@dataclass
class _Run:
    """What the twin knows since the boom was last taken to be at rest."""

    epoch: int
    newest: int
    deviations: Deviations
    strokes: Array
    is_again: bool
    interval: float = 0.0
    slot: int = -1
    memory: PredictionBuffer = field(default_factory=PredictionBuffer)
    plausible: StrokeCheck = field(default_factory=StrokeCheck)
    prediction: Prediction | None = None

    @property
    def estimate(self) -> Array | None:
        """Strokes (m) as estimated at the newest sample, shape (n,); None before the first one."""
        return None if self.prediction is None else self.prediction.strokes

    def rebase(self, shift: int) -> None:
        """All stamps are later by `shift` (ns); what is remembered by stamps is forgotten."""
        self.epoch += shift
        self.newest += shift
        self.deviations.rebase(shift)
        self.memory = PredictionBuffer()


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
        self._build()
        self._channels = channels_of(self.plan.joints)
        self._lines = {stream: StampCheck(self.settings) for stream in Stream}
        self._beyond = FAR * self.settings.stroke_variance**0.5
        self._shortest = [-self._beyond] * len(scene.joints)
        self._longest = [joint.cylinder.max_stroke + self._beyond for joint in scene.joints]
        self._edge = SampleCheck(self._channels)
        self._run: _Run | None = None
        self._failed: int | None = None
        self._speeds: Array | None = None
        self._pending: deque[Sample] = deque()
        self.requests, self._zeros, self._recent = (
            Requests(self.settings),
            SensorZeros(self._channels),
            ResidualBuffer(self._channels),
        )

    def reset(self) -> None:
        """Forget all samples; the next full stroke sample starts from static equilibrium. Load, limits and zeros stay."""
        self._begin_anew()
        self._speeds = None
        self._lines = {stream: StampCheck(self.settings) for stream in Stream}
        self._pending = deque()

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
        self._boom, self._valid = BoomPredictor(scene, self.settings), SHARE * scene.reach
        self.plan = self._boom.plan
        self.judge = None
        if self.baseline is not None:
            self.judge = HealthMonitor(scene, self.settings, self.mounts, self.baseline, self._on_block)
        self._mounting = Mounting(self.plan, self.scene.base.inclination, self.mounts)

    def _take_over(self, stamp: int) -> list[str]:
        """Make what was asked for hold; gives the events. Another load, or other zeros of strokes, need a start from rest."""
        asked, before = self.requests, self.settings
        from_rest, self.settings = asked.take(), asked.settings
        events = ["load"] if before.load != self.settings.load else []
        if before.limits != self.settings.limits:
            events.append("limits")
            for line in self._lines.values():
                line.tune(self.settings)
        if asked.zeros != self._zeros.values:
            events.append("zero")
            from_rest |= self._zeros.put(stamp, asked.zeros)
        if (from_rest or "load" in events) and self._run is not None:
            events += [] if events else ["reset"]
            self._begin_anew()
            self._pending = deque(sample for sample in self._pending if sample.stamp >= stamp)
        if "load" in events:
            self._build()
        return events

    def _begin_anew(self) -> None:
        self._run = None
        self._zeros.forget_past()
        self._recent.clear()
        if self.judge is not None:
            self.judge.begin()

    def warm_up(self) -> None:
        """Compile every kernel, with a twin of the same boom that is thrown away."""
        other = Twin(self.scene, self.settings)
        middle = np.radians([sum(joint.range_deg) / 2 for joint in self.scene.joints])
        strokes = np.array([stroke_curve(self.scene, i, middle[i : i + 1])[0] for i in range(len(middle))])
        for k in range(20):
            other.update(Sample(Stream.STROKES, k * 5_000_000, strokes))
        other.update(Sample(Stream.ANGLES, 0, middle))

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
        complete = _are_readings(sample.values.tolist())
        if not complete:
            usable = np.abs(sample.values) <= LIMIT
            if not usable.any():
                return self._refuse(sample, "empty")
            sample = replace(sample, values=np.where(usable, sample.values, np.nan))
        if sample.stream is Stream.STROKES:
            return self._take_strokes(sample, complete)
        return self._take_measured(sample, complete)

    # -- strokes ----------------------------------------------------------------------------------------------------

    def _take_strokes(self, sample: Sample, complete: bool) -> Report:
        line, run, values = self._lines[Stream.STROKES], self._run, self._zeroed(sample)
        if run is None:
            return self._follow(sample, values, complete, [])
        span = sample.stamp - run.newest
        if line.is_next(sample.stamp) and span >= SHORTEST:
            estimate = run.estimate
            if estimate is not None and run.plausible.is_of_others(sample.stamp - run.epoch, values, estimate, self.settings):
                self.counts["implausible"] += 1
                return Report(sample.stamp, True, events=("implausible",))
            return self._follow(sample, values, complete, [])
        if 0 <= span < SHORTEST:
            same = is_close(values, run.strokes, 0.0, self.settings)
            return self._refuse(sample, "duplicate" if same else "second source")
        if line.is_soon(sample.stamp) and goes_on(self._boom, run.strokes, values, span * NANO, 0.0, self.settings):
            return self._follow(sample, values, complete, [])
        then = run.memory.at(sample.stamp)
        back = (run.newest - sample.stamp) * NANO
        if then is not None and back <= self.settings.jump_back and np.array_equal(then.strokes, values):
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
        return bool(surprise(sample.values, last.values) > way)

    def _is_late(self, run: _Run, stamp: int, values: Array) -> bool:
        """Whether it is back by little, and its strokes are those of its stamp."""
        if not -self.settings.jump_back <= (stamp - run.newest) * NANO < 0.0:
            return False
        then = run.memory.at(stamp)
        return then is None or is_close(values, then.strokes, run.interval, self.settings)

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
        if why is TimeStep.EITHER and run.prediction is not None:
            run.deviations.add_phase(first.stamp, run.prediction)

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
            self._pending = deque(sample for sample in self._pending if sample.stamp <= before)
        if self.judge is not None:
            self.judge.begin()

    def _zeroed(self, sample: Sample) -> Array:
        """Strokes without what their sensors read too much."""
        zeros = self._zeros.of(Stream.STROKES, sample.stamp)
        return sample.values if zeros is None else sample.values - zeros

    def _follow(self, sample: Sample, values: Array, complete: bool, events: list[str]) -> Report:
        """Go on to a stroke sample, whose `values` are without the sensors' zeros; the model starts if it has not."""
        if not complete:
            events.append("partial")
        asked = complete and self.requests.due
        if asked:
            events += self._take_over(sample.stamp)
            values = self._zeroed(sample)
        told = asked or "clock set" in events
        if self._are_beyond_travel(values.tolist()):
            events.append("out of range")
        if values is not sample.values:
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

    def _are_beyond_travel(self, strokes: list[float]) -> bool:
        """Whether one is where its cylinder cannot stand; those that are missing are not."""
        return any(map(lt, strokes, self._shortest)) or any(map(gt, strokes, self._longest))

    def _start(self, sample: Sample, events: list[str]) -> Report:
        try:
            self._boom.start(sample.values)
        except BoomTwinError as error:
            self._failed = sample.stamp if isinstance(error, SolverError) else self._failed
            return self._refuse(sample, "model", *events, status=str(error))
        speeds, self._speeds = self._speeds, None
        deviations = Deviations(self.plan, self.settings, sample.stamp, speeds)
        self._run = _Run(sample.stamp, sample.stamp, deviations, sample.values, speeds is not None)
        return self._step(self._run, sample, events)

    def _step(self, run: _Run, sample: Sample, events: list[str]) -> Report:
        self._lines[Stream.STROKES].take(sample.stamp)
        values, oddities = run.plausible.of(sample.stamp - run.epoch, sample.values, run.estimate, self.settings)
        events += oddities
        status = self._boom.step((sample.stamp - run.epoch) * NANO, values)
        if status != OK:
            self.reset()
            self._failed = sample.stamp
            return self._refuse(sample, "model", *events, status=SENTENCES[status])
        span = (sample.stamp - run.newest) * NANO
        run.interval += SMOOTHING * (span - run.interval) if run.interval else span
        before, run.newest, run.slot, run.strokes = run.slot, sample.stamp, sample.stamp // SHAPE_PERIOD, sample.values
        prediction = self._boom.prediction(sample.stamp, shaped=run.slot != before)
        run.prediction = prediction
        self._remember(run, prediction)
        if math.hypot(*prediction.tip_displacement.tolist()) > self._valid:
            events.append("deflected")
        if events:
            self.counts.update(events)
        if self.judge is not None:
            self.judge.predicted(prediction, sample.values, self._boom.variances, run.deviations.noise, run.deviations.tip)
        residuals = self._settle_pending(run)
        health = None if self.judge is None else self.judge.judge(sample.stamp)
        return Report(sample.stamp, True, prediction, residuals, tuple(events), passes=self._boom.passes, health=health)

    def _remember(self, run: _Run, prediction: Prediction) -> None:
        """Keep what residuals need."""
        boom, interval = self._boom, run.interval or self.settings.step
        joint_sigmas, force_sigmas = run.deviations.at(prediction, interval, boom.variances, boom.live, boom.angles)
        gravity = self.plan.tables.gravity
        now = PredictedBoom(prediction, boom.live, gravity, self._mounting, self.settings, joint_sigmas, force_sigmas)
        run.memory.add(expected_readings(now, run.strokes))

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
        if self._run is None or sample.stamp > self._run.newest:
            if len(self._pending) == PENDING:
                self._pending.popleft()
                self.counts["unmatched"] += 1
            self._pending.append(sample)
            return Report(sample.stamp, True, events=events)
        residuals = self._residuals(self._run, sample)
        if residuals is None:
            return self._refuse(sample, "unmatched", *events)
        return Report(sample.stamp, True, residuals=(residuals,), events=events)

    def _settle_pending(self, run: _Run) -> tuple[Residuals, ...]:
        """Residuals of all samples that waited for the newest stroke."""
        if not self._pending:
            return ()
        ready = sorted((s for s in self._pending if s.stamp <= run.newest), key=lambda s: (s.stamp, s.stream.value))
        self._pending = deque(s for s in self._pending if s.stamp > run.newest)
        found = [self._residuals(run, sample) for sample in ready]
        self.counts["unmatched"] += found.count(None)
        return tuple(residuals for residuals in found if residuals is not None)

    def _residuals(self, run: _Run, sample: Sample) -> Residuals | None:
        expected = run.memory.at(sample.stamp)
        if expected is None:
            return None
        values, sigmas = sample.values - expected.values[sample.stream], expected.sigmas[sample.stream]
        if sample.stream is Stream.ANGLES:
            values = self._mounting.unwound(values)
        self._recent.add(sample.stamp, sample.stream, values)
        zeros = self._zeros.of(sample.stream, sample.stamp)
        if zeros is not None:
            values = values - zeros
        residuals = Residuals(sample.stream, sample.stamp, self._channels[sample.stream], values, sigmas)
        if self.judge is not None:
            self.judge.measured(residuals, sample.values)
        return residuals

    def _hold(self, sample: Sample, event: str) -> Report:
        """Taken as a witness of time alone, at first."""
        self.counts[event] += 1
        return Report(sample.stamp, True, events=(event,))

    def _refuse(self, sample: Sample, *events: str, status: str = "ok") -> Report:
        self.counts.update(events)
        return Report(sample.stamp, False, events=events, status=status)


def _are_readings(values: list[float]) -> bool:
    """Whether none is missing, not finite or absurd."""
    return math.isfinite(sum(values)) and max(map(abs, values)) <= LIMIT
