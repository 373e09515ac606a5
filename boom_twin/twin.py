"""The twin: samples of the rig in, predictions and residuals out. No ROS, no files, no clock."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .analysis.validity import SHARE
from .chain.status import OK, SENTENCES
from .deviations import Deviations, specific_force
from .errors import BoomTwinError, UsageError
from .following import Following
from .health.baseline import Baseline
from .health.judge import Judge
from .load import loaded
from .memory import Expected, Memory
from .mounting import Mounting
from .plausible import Plausible
from .recent import Recent
from .records import Change, Mount, Prediction, Report, Residuals, Sample, Stream, channels_of
from .requests import Requests
from .scene.kinematics import stroke_curve
from .scene.parts import Scene
from .settings import Settings
from .stray import Strays
from .zeros import Zeros

EVENTS = {
    "late": "stamp not after the newest one of its stream; sample left out",
    "duplicate": "stamp as the newest one of its stream; sample left out",
    "partial": "some values missing or not finite; the others were used",
    "empty": "no usable value; sample left out",
    "waiting": "not all strokes known yet; the model has not started",
    "gap": "longer pause between strokes, bridged",
    "restart": "pause too long to bridge; started again from rest",
    "leap": "stamp far from the newest one of its stream; left out unless the next sample follows it",
    "jump back": "time was set back; everything started again",
    "implausible": "a stroke where its cylinder cannot be; left out unless the next ones agree",
    "held": "a stroke missing for long; taken to stay where it was",
    "model": "the model failed; it starts again with the next full sample",
    "reset": "asked for; the model started again from rest",
    "load": "payload or line fill changed; the model started again from rest",
    "limits": "other settings changed while the twin ran",
    "zero": "the zero of a sensor was set anew",
    "deflected": "tip further than half the boom's reach from the undeformed boom's: outside the model's validity",
    "unmatched": "no prediction at the stamp of this sample; no residual",
}

TOLD_AT_ONCE = frozenset({"restart", "jump back", "reset", "load", "limits", "zero"})
"""Events that `Report.change` goes with."""

NANO = 1e-9
SMOOTHING = 0.05  # weight of the newest interval in the running mean
PENDING = 4096  # most samples that wait for a stroke
SHAPE_PERIOD = 100_000_000  # ns of one slot; one shape is given in each, 10 a second


@dataclass
class _Run:
    """What the twin knows since the boom was last taken to be at rest."""

    epoch: int
    newest: int
    deviations: Deviations
    interval: float = 0.0
    slot: int = -1
    memory: Memory = field(default_factory=Memory)
    plausible: Plausible = field(default_factory=Plausible)


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
        `boom_twin.mounting.Mounting`.
    baseline : Baseline, optional
        What model and sensors are off by while all is well. With it the rig's health is judged, see `Report.health`.

    Attributes
    ----------
    mounts : tuple of Mount or None
        As given, one for every joint.
    counts : Counter
        How often each of `EVENTS` happened.
    requests : Requests
        What is asked while samples come: another load, other limits, a start from rest. It takes effect with the next full
        stroke sample, which `Report.change` tells.
    judge : Judge or None
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
    ) -> None:
        self.scene, self.settings, self.baseline = scene, settings or Settings(), baseline
        self.counts: Counter[str] = Counter()
        self.mounts = tuple(mounts) or (None,) * len(scene.joints)
        self._build()
        self._channels = channels_of(self.plan.joints)
        self._strays = Strays(self.settings)
        self._run: _Run | None = None
        self._newest_measured: dict[Stream, int] = {}
        self._pending: deque[Sample] = deque()
        self.requests, self._zeros, self._recent = Requests(self.settings), Zeros(self._channels), Recent(self._channels)

    def reset(self) -> None:
        """Forget all samples; the next full stroke sample starts from static equilibrium. Load, limits and zeros stay."""
        self._begin_anew()
        self._strays = Strays(self.settings)
        self._newest_measured = {}
        self._pending = deque()

    def rezero(self, sensor: str) -> dict[str, float]:
        """Ask that the mean residual of the last second becomes the zero of a sensor; gives its new zeros by channel.

        Parameters
        ----------
        sensor : str
            ``joint_i`` (rad), ``tip_imu`` (m/s^2, both axes), or ``cylinder_i`` (m). A stroke has no residual of its own:
            its zero becomes the one that explains the residual of ``joint_i``, which must read right for that; and the
            model, which the strokes drive, starts again from rest.

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
        self._boom, self._valid = Following(scene, self.settings), SHARE * scene.reach
        self.plan = self._boom.plan
        self.judge = None if self.baseline is None else Judge(scene, self.settings, self.mounts, self.baseline)
        self._mounting = Mounting(self.plan, self.scene.base.inclination, self.mounts)

    def _take_over(self, stamp: int) -> list[str]:
        """Make what was asked for hold; gives the events. Another load, or other zeros of strokes, need a start from rest."""
        asked, before = self.requests, self.settings
        from_rest, self.settings = asked.take(), asked.settings
        events = ["load"] if before.load != self.settings.load else []
        if before.limits != self.settings.limits:
            events.append("limits")
            self._strays = Strays(self.settings)
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
        """Take one sample; see `Report` for what comes back. Never raises on what a sample holds."""
        complete = bool(np.isfinite(sample.values.sum()))
        if not complete and not np.isfinite(sample.values).any():
            return self._refuse(sample, "empty")
        if sample.stream is Stream.STROKES:
            return self._take_strokes(sample, complete)
        return self._take_measured(sample, complete)

    # -- strokes ----------------------------------------------------------------------------------------------------

    def _take_strokes(self, sample: Sample, complete: bool) -> Report:
        events: list[str] = []
        if self._strays.hold(sample, None if self._run is None else self._run.newest):
            return self._hold(sample)
        if self._run is not None:
            span = (sample.stamp - self._run.newest) * NANO
            if -self.settings.jump_back <= span <= 0.0:
                return self._refuse(sample, "duplicate" if span == 0.0 else "late")
            if span < 0.0 or span > self.settings.restart_gap:
                events.append("jump back" if span < 0.0 else "restart")
                self.reset()
            elif span > self.settings.gap:
                events.append("gap")
        if not complete:
            events.append("partial")
        asked = complete and self.requests.due
        if asked:
            events += self._take_over(sample.stamp)
        zeros = self._zeros.of(Stream.STROKES, sample.stamp)
        if zeros is not None:
            sample = replace(sample, values=sample.values - zeros)
        if self._run is not None:
            report, from_rest = self._step(self._run, sample, events), False
        elif complete:
            report, from_rest = self._start(sample, events), True
        else:
            return self._refuse(sample, "waiting", *events)
        if asked or (from_rest and report.accepted):
            return replace(report, change=Change(sample.stamp, from_rest, self.settings.live, self._zeros.values))
        return report

    def _start(self, sample: Sample, events: list[str]) -> Report:
        try:
            self._boom.start(sample.values)
        except BoomTwinError as error:
            return self._refuse(sample, "model", *events, status=str(error))
        self._run = _Run(sample.stamp, sample.stamp, Deviations(self.plan, self.settings, sample.stamp))
        return self._step(self._run, sample, events)

    def _step(self, run: _Run, sample: Sample, events: list[str]) -> Report:
        values, oddities = run.plausible.of(sample.stamp, sample.values, self.settings)
        events += oddities
        status = self._boom.step((sample.stamp - run.epoch) * NANO, values)
        if status != OK:
            self.reset()
            return self._refuse(sample, "model", *events, status=SENTENCES[status])
        span = (sample.stamp - run.newest) * NANO
        run.interval += SMOOTHING * (span - run.interval) if run.interval else span
        before, run.newest, run.slot = run.slot, sample.stamp, sample.stamp // SHAPE_PERIOD
        prediction = self._boom.prediction(sample.stamp, shaped=run.slot != before)
        run.plausible.estimate = prediction.strokes
        self._remember(run, prediction)
        if math.hypot(*prediction.tip_displacement) > self._valid:
            events.append("deflected")
        if events:
            self.counts.update(events)
        if self.judge is not None:
            self.judge.predicted(prediction, sample.values, self._boom.variances, run.deviations.noise)
        residuals = self._settle_pending(run)
        health = None if self.judge is None else self.judge.judge(sample.stamp)
        return Report(sample.stamp, True, prediction, residuals, tuple(events), passes=self._boom.passes, health=health)

    def _remember(self, run: _Run, prediction: Prediction) -> None:
        """Keep what residuals need."""
        boom, interval = self._boom, run.interval or self.settings.step
        joint_sigmas, force_sigmas = run.deviations.at(prediction, interval, boom.variances, boom.live, boom.angles)
        angles = self._mounting.expected(prediction.joints, boom.live)
        angle_sigmas = self._mounting.deviations(joint_sigmas, self.settings.angle_variance)
        force = specific_force(prediction, self.plan.tables.gravity)
        run.memory.add(Expected(prediction.stamp, angles, force, angle_sigmas, force_sigmas))

    # -- measured angles and accelerations ----------------------------------------------------------------------------

    def _take_measured(self, sample: Sample, complete: bool) -> Report:
        newest = self._newest_measured.get(sample.stream)
        if self._strays.hold(sample, newest):
            return self._hold(sample)
        if newest is not None and newest - self.settings.jump_back / NANO <= sample.stamp <= newest:
            return self._refuse(sample, "duplicate" if sample.stamp == newest else "late")
        self._newest_measured[sample.stream] = sample.stamp
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
        if sample.stream is Stream.ANGLES:
            values, sigmas = self._mounting.residuals(sample.values, expected.angles), expected.angle_sigmas
        else:
            values, sigmas = sample.values - expected.force, expected.force_sigmas
        self._recent.add(sample.stamp, sample.stream, values)
        zeros = self._zeros.of(sample.stream, sample.stamp)
        if zeros is not None:
            values = values - zeros
        residuals = Residuals(sample.stream, sample.stamp, self._channels[sample.stream], values, sigmas)
        if self.judge is not None:
            self.judge.measured(residuals, sample.values)
        return residuals

    def _hold(self, sample: Sample) -> Report:
        """Taken as a witness of time alone."""
        self.counts["leap"] += 1
        return Report(sample.stamp, True, events=("leap",))

    def _refuse(self, sample: Sample, *events: str, status: str = "ok") -> Report:
        self.counts.update(events)
        return Report(sample.stamp, False, events=events, status=status)
