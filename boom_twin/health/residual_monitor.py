"""Monitor residuals for lasting deviations: suspicion, alarm, ranked causes; and go on with faults that are known.

A fault that has a name, a size that no longer changes and an explanation that fits becomes part of what is known: residuals are
judged about it from then on, its alarm stays. So a second fault is found, and the first one's end or change.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..analysis.modal import StrokeNoise
from ..config.settings import Settings
from ..scene.schema import Scene
from ..types import NANO, SECOND, Alarm, Array, Mount, Stream
from .alarm_text import LIMIT_OF, LISTED, AlarmText
from .baseline import JUDGED, Baseline
from .detection import Detector
from .hold_test import DOUBTED, HoldTest
from .inference.block_problem import BLOCK, BlockMeans, BlockProblem, LinearModel
from .inference.fault_catalogue import Form, parameters
from .inference.holds import HoldProblem
from .inference.hypotheses import Explanation, HypothesisTest, Regression, Verdict
from .inference.innovation_filter import KEEPS_STEP, InnovationFilter
from .inference.sensitivities import Signature
from .suspicion import CRUDE, DETUNING, MISFIT, RECENT, SURE, WHOLE_MISFIT, Suspicion, carried_on, load_levels, refuted
from .tip_load import TipLoadMonitor

OFFSETS = ("bias", "drift")  # kinds of faults whose size is what a sensor is off by
SUSPICIOUS, CLEAN = 0.25, 0.05  # levels at which a suspicion begins, and is given up if it has not become an alarm
SKIPPED = 2  # blocks in which a fault may still be on its way
LEAST_SPAN, SWINGS = 3.0, 4.5  # s that evidence has to take for an alarm if it is obvious; and else: a pump's stroke, a gust
UNEXPLAINED = 4.0  # s for which nothing explains the deviation, before that is an alarm
EXCITED_FOR = 20.0  # s for which a load counts after it last showed
LOAD_MEANS = 3.0  # times the load's level: less weight than that may be its mean, and is no fault
LIMITS_PERIOD = 60  # blocks of a suspicion between two looks at what could be told, a multiple of the next
SETTLING = 3 * SECOND  # ns after growth that goes otherwise than it did, before evidence begins anew
PERIOD = 3  # blocks between two looks at a suspicion
OBVIOUS = 60.0  # ln of how much more probable than none a fault must be not to wait for a load to show
GONE, GONE_AFTER = 3.0, 3.0  # likewise, of a suspicion that has taken so long (s), below which the fault is there no more
KNOWN_AFTER, KNOWN_WITHIN = 5.0, 0.1  # s that a suspicion takes, and deviation over size, before the twin goes on with a fault
KIND_TOLD = 4.6  # ln of how much more probable what is the matter with a sensor must be than another of its faults, likewise
HELD, LET_GO = 12.0, 4.0  # ln of how much more probable by holds a fault must be than none for an alarm, and to keep it
ENDED = 8.0  # ln by which a known fault's end may go worse with what is measured than the best explanation
AFRESH, EVERY = 30, 15  # blocks of evidence that is collected afresh beside an alarm (is its fault there?), begun so often


@dataclass(frozen=True)
class _KnownFault:
    """A fault that the twin goes on with: its alarm, its parameter, that one's value and how unsure it is (deviation)."""

    alarm: Alarm
    place: int
    value: float
    sigma: float = 0.0


@dataclass(frozen=True)
class _Afresh:
    """Evidence that is collected afresh beside an alarm, and what may explain that alarm, when it began."""

    evidence: Suspicion
    explained: tuple[Explanation, ...]


class ResidualMonitor:
    """See the module.

    Parameters
    ----------
    scene : Scene
        With its load.
    settings : Settings
    mounts : tuple of Mount or None
    baseline : Baseline
    names : tuple of str
        Of the channels.
    on_block : callable, optional
        Is told every linear problem; what a baseline is learnt from.

    Attributes
    ----------
    surprise : ndarray, shape (channels,)
        What the newest block leaves that healthy deviations and known faults do not explain; of unit variance, NaN where
        nothing was measured.
    covariance : ndarray, shape (parameters, parameters)
        Of the parameters while all is well, as the baseline has it.
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        mounts: tuple[Mount | None, ...],
        baseline: Baseline,
        names: tuple[str, ...],
        on_block: Callable[[BlockProblem], object] | None = None,
    ) -> None:
        known, n = parameters(scene), len(scene.joints)
        self._scene = scene
        self._names, self._count = names, len(known)
        self._linear = LinearModel(scene, settings, mounts, known)
        self._mean, self.covariance = baseline.healthy(known)
        self._errors2, self._noise2, self._detuning = baseline.errors(n) ** 2, baseline.noise(n) ** 2, baseline.detuning
        late = [each.form is Form.DELAY and tuple(JUDGED)[each.index] is Stream.IMU for each in known]
        self._out_of_step = np.diag(np.where(late, (baseline.detuning * KEEPS_STEP) ** 2, 0.0))
        self._levels = load_levels(scene)
        self._bank = HypothesisTest(known)
        self._tell = AlarmText(scene, known, self._linear.signatures, baseline.errors(n))
        self._known: dict[str, _KnownFault] = {}
        self._detector = Detector(len(names), BLOCK * NANO, settings.false_alarms / 86400.0)
        self._on_block = on_block
        self._regression = Regression(self._mean, self.covariance)
        self._tip_load = TipLoadMonitor(settings.tip_load_limit)
        self._frequency_error = baseline.frequency_error
        self._hold_test = HoldTest(self._bank, self._errors2, baseline.frequency_error)
        self._hold_alarm: Alarm | None = None
        self._is_held = False  # whether that was certain once
        self.begin()

    def begin(self) -> None:
        """The boom starts from rest: what moved is forgotten, what is known of its parameters and faults is kept."""
        self._linear.begin()
        self._suspicion: Suspicion | None = None
        self._alarm: Alarm | None = None
        self._carried: dict[str, float] = {}
        self._refuted: frozenset[str] = frozenset()  # causes that evidence which has fitted rules out for this alarm
        self._blocks = 0
        self._tip_load.begin()
        self._resized: int | None = None  # stamp (ns) from which on another size goes better with what is recent
        self._unexplained: int | None = None  # stamp (ns) from which on nothing explains the deviation
        self._shaken = np.full(len(self._levels), -math.inf)  # when the load last was of each level, ns
        self._limits: dict[str, float] = {}
        self._watch_anew()

    def _watch_anew(self) -> None:
        """Begin to look for deviations from what is known now."""
        detuning = DETUNING if self._known else self._detuning
        self._healthy = InnovationFilter(len(self._names), 1 + self._count, BLOCK * NANO, detuning)
        self._detector.reset()
        self._afresh: tuple[_Afresh, ...] = ()
        self.surprise = np.full(len(self._names), np.nan)

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """Those that last: of faults that are known, and what is being looked into."""
        open_ones = [each for each in (self._alarm, self._tip_load.alarm, self._hold_alarm) if each is not None]
        return (*(each.alarm for each in self._known.values()), *open_ones)

    @property
    def blamed(self) -> dict[str, float]:
        """Causes that may explain the alarms that last, and the offset that each would be, SI; NaN of one that is none."""
        ranks = [rank for each in self.alarms for rank in each.ranked]
        return {rank.cause: next((part[1] for part in rank.parts if part[0] in OFFSETS), math.nan) for rank in ranks}

    def is_shaken(self, stamp: int) -> bool:
        """Whether a load shakes the boom at `stamp` (ns), or has lately.

        The lowest level above none does not count: what a model that is two percent wrong leaves may look like that.
        """
        return self._load_lately(stamp) > float(self._levels[1])

    @property
    def limits(self) -> dict[str, float]:
        """From which loss of stiffness (share) on each cylinder could be told under the load of late; empty without one."""
        return self._limits

    def _limits_of(self, suspicion: Suspicion, level: int) -> dict[str, float]:
        """See `limits`; by the evidence of an open suspicion."""
        least = suspicion.least_told(level, SURE)
        softer = [(each.cause, least[i]) for i, each in enumerate(self._bank.known) if each.cause.endswith(".k")]
        return {LIMIT_OF + cause: float(value / (1.0 + value)) for cause, value in softer if math.isfinite(value)}

    @property
    def levels(self) -> Array:
        """How near each channel is to an alarm, 1 and above while there is one; shape (channels,)."""
        return self._detector.levels

    @property
    def signature(self) -> Signature | None:
        """At the present posture."""
        return self._linear.signature

    def take(self, block: BlockMeans, noise: StrokeNoise) -> list[Alarm]:
        """Take one block; gives the alarms that began, changed or ended."""
        problem = self._linear.take(block, noise)
        if problem is None or not np.isfinite(block.left).any():
            return []
        if self._on_block is not None:
            self._on_block(problem)
        if self._known:
            problem = problem._replace(strokes=problem.strokes + np.diag(self._known_in_motion2(problem)))
        news = [] if problem.hold is None else self._judge_hold(problem.hold)
        self._watch(problem)
        if self._limits and not self.is_shaken(block.start):
            self._limits = {}
        news += self._look_for_end(problem)
        if self._suspicion is None or problem.start < self._suspicion.start:
            return news
        self._suspicion.take(problem, self.is_shaken(problem.start))
        self._blocks += 1
        if self._blocks % PERIOD == 0:
            news += self._look(block.start)
            others = {self._alarm.cause if self._alarm is not None else None, *self._known}
            if self._hold_alarm is not None and self._hold_alarm.cause in others - {None}:  # one fault is one alarm
                news += self._end_hold_alarm(block.start)
        return news

    def _judge_hold(self, hold: HoldProblem) -> list[Alarm]:
        """Weigh all holds, while there is no alarm of what their blocks say; gives the news."""
        if self._suspicion is not None:
            self._suspicion.take_hold(hold, self._frequency_error)
        if self._alarm is not None or self._tip_load.alarm is not None:
            return []
        about = self._mean_about_known(), self._covariance_about_known()
        found = self._hold_test.take(hold, *about)
        for each in self._known.values():
            if self._hold_test.change(each.place, -each.value, *about) > max(HELD, found.verdict.strength - ENDED):
                return self._end_known(each, hold.end)
        is_load = self._weight(found.verdict.best) < LOAD_MEANS * self._load_lately(hold.end)
        is_sure = found.verdict.strength >= HELD
        if is_sure and self._hold_alarm is None and not is_load:
            is_sure = not self._hold_test.is_of_one_frequency(found, *about)
        is_far = found.is_far and (math.isinf(self._weight(found.verdict.best)) or len(hold.modes) > 0)  # no mean of a load
        if self._hold_alarm is None and (not (is_sure or is_far) or is_load):
            return []
        self._is_held = is_sure or (self._is_held and self._hold_alarm is not None)
        if found.verdict.strength < (LET_GO if self._is_held else DOUBTED):
            return self._end_hold_alarm(hold.end)
        alarm = self._hold_alarm or Alarm("tip", "residual", found.since, None, None, "")
        if self._is_held:
            is_borne_out = self._hold_test.is_borne_out(found, *about)
            self._hold_alarm = alarm = self._tell.of_holds(alarm, found.verdict, found.tip, is_borne_out)
        else:
            self._hold_alarm = alarm = self._tell.of_far_tip(alarm, found.verdict, found.tip, self._hold_test.telling)
        if alarm.cause == found.verdict.causes[0].name and alarm.cause not in self._known:
            self._go_on_with_held(found.verdict)
        return [alarm]

    def _go_on_with_held(self, verdict: Verdict) -> None:
        """The fault that holds have named becomes known, as sure as its size is: blocks would tell it once more."""
        assert self._hold_alarm is not None
        best = verdict.best
        sigma = best.sigma * verdict.excess**0.5
        self._known[verdict.causes[0].name] = _KnownFault(self._hold_alarm, best.place, best.value, sigma)
        self._hold_alarm, self._suspicion, self._unexplained, self._carried = None, None, None, {}
        self._start_about_known()

    def _end_hold_alarm(self, stamp: int) -> list[Alarm]:
        """End the alarm by holds, if there is one."""
        ended = [] if self._hold_alarm is None else [replace(self._hold_alarm, until=stamp)]
        self._hold_alarm = None
        return ended

    def _watch(self, problem: BlockProblem) -> None:
        """Innovations beyond what healthy parameters and known faults explain; the first suspicious one begins a suspicion."""
        self._healthy.tune(problem.modes)
        noise, known = problem.noise(self._noise2), self._regression
        shaking = self._healthy.vibration(problem.shaking)
        found = self._healthy.step(problem.table, noise, self._errors_about(problem), shaking, problem.travel)
        left, _ = known.take(found.white, self._suspicion is None)
        self.surprise = left if len(left) == len(self._names) else self._among_all(problem, left)
        if self._alarm is not None:
            return
        self._detector.take(self.surprise)
        if known.has_strayed and self._tip_load.alarm is None:  # too slowly for the detector; now it will be told at once
            known.restart()
            self._suspicion = None
        if self._suspicion is None and self._detector.suspicion > SUSPICIOUS:
            self._carried = {}
            self._suspect(problem.start + SKIPPED * BLOCK)

    def _among_all(self, problem: BlockProblem, left: Array) -> Array:
        """What is left of the channels that were measured in their places among all; NaN of the others."""
        surprise = np.full(len(self._names), np.nan)
        surprise[np.isfinite(problem.table[:, 0])] = left
        return surprise

    def _errors_about(self, problem: BlockProblem) -> Array:
        """Variance of the model's error (channels,), and of the signatures of known faults."""
        errors2 = self._errors2
        for each in self._known.values():
            errors2 = errors2 + (CRUDE * each.value * problem.table[:, 1 + each.place]) ** 2
        return errors2

    def _known_in_motion2(self, problem: BlockProblem) -> Array:
        """Variances (channels,) of what known faults do that change how forces bend the boom: signatures are those of rest.

        While the tip is accelerated forces are others by that share of gravity.
        """
        bent2 = np.zeros(len(self._names))
        for each in self._known.values():
            if self._bank.known[each.place].form is Form.SCENE:
                bent2 += (each.value * problem.table[:, 1 + each.place]) ** 2
        gravity = np.asarray(self._scene.gravity)
        return np.asarray(problem.shaking / (gravity @ gravity) * bent2)

    def _suspect(self, start: int) -> None:
        """Collect evidence from `start` (ns) on.

        A vibration whose frequency is a little wrong runs ahead or behind, always the same way: nearly all that an IMU says of
        its lag is said by vibration, so a lag may be as large without a fault.
        """
        self._suspicion, self._blocks = self._suspicion_from(start, self._carried), 0
        self._resized = None
        self._tell.begin_anew()

    def _suspicion_from(self, start: int, carried: dict[str, float]) -> Suspicion:
        """Evidence to be collected from `start` (ns) on, see `_suspect`."""
        known = self._regression.mean, self._regression.covariance + self._out_of_step
        return Suspicion(self._bank, start, *known, self._errors2, self._noise2, self._levels, self._detuning, carried)

    def _look_for_end(self, problem: BlockProblem) -> list[Alarm]:
        """Take one block as evidence that begins anew all the time, and end the alarm or the known fault that it refutes.

        What a suspicion has collected before the end of a fault outweighs what comes after it for long: to its filter, the
        end is one more error of the model or a load. Evidence from after the end knows neither the fault nor its end: no fault
        explains it well, and one of the size that the alarm has would be much less probable. Some begins before the one
        before is judged, or an end in the midst of that one would wait for the whole of the next.
        """
        if self._suspicion is None or (self._alarm is None and not self._known):
            self._afresh = ()
            return []
        if not self._afresh or self._afresh[-1].evidence.blocks == EVERY:
            self._afresh = (*self._afresh, _Afresh(self._suspicion_from(problem.start, {}), self._explain_now()))
        for each in self._afresh:
            each.evidence.take(problem, self.is_shaken(problem.start))
        if self._afresh[0].evidence.blocks < AFRESH:
            return []
        (oldest, *_), self._afresh = self._afresh, self._afresh[1:]
        verdict = oldest.evidence.explain()
        if verdict.strength >= SURE and (known := self._change_of_known(oldest.evidence, verdict)) is not None:
            return self._end_known(known, problem.start)
        is_free = self._alarm is not None and verdict.strength < GONE and bool(oldest.explained)
        is_over = is_free and all(oldest.evidence.log_factor(each) < -HELD for each in oldest.explained)
        return self._end_open(problem.start) if is_over else []

    def _explain_now(self) -> tuple[Explanation, ...]:
        """What may explain the alarm, by all evidence so far; if that is not sure, what could when some last began afresh."""
        assert self._suspicion is not None
        verdict = self._suspicion.explain()
        if verdict.strength < SURE:
            return self._afresh[-1].explained if self._afresh else ()
        likely = [cause for cause in verdict.causes if cause.probability >= LISTED]
        return tuple(cause.parts[0] for cause in likely)

    # -- suspicion, alarm, end ------------------------------------------------------------------------------------------

    def _look(self, start: int) -> list[Alarm]:
        """Weigh all that was collected; gives the news."""
        suspicion = self._suspicion
        assert suspicion is not None
        if self._alarm is None and self._detector.suspicion < CLEAN:
            self._suspicion, self._unexplained = None, None
            return self._tip_load.end(start)
        verdict = suspicion.explain()
        self._shaken[verdict.level] = start
        if self._blocks % LIMITS_PERIOD == 0 and self._alarm is None:
            self._limits = self._limits_of(suspicion, verdict.level) if verdict.level > 1 else {}
        news = self._judge_load(start, suspicion, verdict) + self._judge(start, suspicion, verdict)
        if self._suspicion is not suspicion:
            return news
        recent = suspicion.recent_fit(verdict)
        is_resized = recent.is_resized and self._alarm is not None
        self._resized = (self._resized or start) if is_resized else None
        if self._resized is not None and self._load_lately(start) > 0.0 and not verdict.best.is_growing:
            is_resized = start - self._resized >= RECENT * BLOCK  # the flank of a pulse has passed by then
        holds_onset = self._alarm is not None and suspicion.start < self._alarm.since  # which neither shape has
        if recent.is_outdated or is_resized or (holds_onset and verdict.strength > OBVIOUS):
            is_odd = verdict.none_excess > WHOLE_MISFIT or verdict.strength >= SURE  # no load explained it
            lately = max(suspicion.start, start - RECENT * BLOCK)  # before that it was explained
            self._unexplained = (self._unexplained or lately) if is_odd else None
            has_shape = not (is_resized or holds_onset or verdict.best.is_growing) and self._alarm is not None
            self._carried = carried_on(verdict) if has_shape else {}
            if has_shape and verdict.strength >= SURE:
                self._refuted |= refuted(verdict)
            is_still_growing = is_resized and verdict.best.is_growing  # perhaps: it may grow on more slowly
            self._suspect(start + (SETTLING if is_still_growing else BLOCK))
        elif suspicion.is_settled:
            self._unexplained = None
        return news

    def _judge(self, start: int, suspicion: Suspicion, verdict: Verdict) -> list[Alarm]:
        """Open, change or end an alarm."""
        load = self._load_lately(start)
        waiting = LEAST_SPAN if verdict.strength > OBVIOUS else SWINGS
        is_sure = verdict.strength >= SURE and self.levels.max() >= 1.0
        unexplained, is_free = self._unexplained_for(start), self._alarm is None and self._tip_load.alarm is None
        if is_free and unexplained >= UNEXPLAINED and self.levels.max() >= 1.0:
            return self._open(start, suspicion, verdict, unexplained)
        if suspicion.span < waiting or self._weight(verdict.best) < LOAD_MEANS * load:
            return []
        if self._alarm is None:
            return self._open(start, suspicion, verdict, suspicion.span) if is_sure else []
        if verdict.strength < GONE:
            return self._end_open(start) if suspicion.span > GONE_AFTER else []
        if (known := self._change_of_known(suspicion, verdict)) is not None:
            return self._end_known(known, start)
        self._alarm = self._explained(self._alarm, suspicion, verdict, suspicion.span, start, load == 0.0)
        self._go_on_with(suspicion, verdict)
        return [*self.alarms]

    def _judge_load(self, start: int, suspicion: Suspicion, verdict: Verdict) -> list[Alarm]:
        """Compare the load with its limit, where it explains what is measured and no fault does."""
        if self._alarm is not None or verdict.strength >= SURE:
            return self._tip_load.end(start)
        is_load = self._tip_load.alarm is not None or verdict.none_excess <= MISFIT
        return self._tip_load.take(start, *(suspicion.load(verdict.level) if is_load else (0.0, 0.0)))

    def _unexplained_for(self, start: int) -> float:
        """Time (s) for which neither a load nor a fault has explained the deviation: suspicions began anew all the time."""
        return 0.0 if self._unexplained is None else (start - self._unexplained) * NANO

    def _load_lately(self, start: int) -> float:
        """Highest level (N) of the load at the tip lately; 0 of a calm boom."""
        return float(self._levels[start - self._shaken < EXCITED_FOR * SECOND].max(initial=0.0))

    def _weight(self, each: Explanation) -> float:
        """Magnitude (N) of the force at the tip that would be taken for this fault; infinite of one that no load looks like."""
        reach = {"tip.payload": 1.0, "line_fill": 0.5 * self._scene.reach}.get(self._bank.known[each.place].cause, math.inf)
        return abs(each.value) * math.hypot(*self._scene.gravity) * reach

    def _open(self, start: int, suspicion: Suspicion, verdict: Verdict, span: float) -> list[Alarm]:
        """Begin an alarm of a deviation that has lasted for `span` (s), unless it is the end of a known fault."""
        if (known := self._change_of_known(suspicion, verdict)) is not None:
            return self._end_known(known, start)
        channel = int(np.argmax(np.abs(suspicion.size) / np.sqrt(self._errors2)))
        since = start - (self._detector.blocks_since(int(np.argmax(self.levels))) - 1) * BLOCK
        alarm = Alarm(self._names[channel], "residual", since, None, None, "")
        self._refuted = frozenset()
        self._alarm = self._explained(alarm, suspicion, verdict, span, start, self._load_lately(start) == 0.0)
        is_same = self._hold_alarm is not None and self._hold_alarm.cause is None  # one fault is one alarm
        return [*(self._end_hold_alarm(start) if is_same else []), self._alarm]

    def _explained(self, alarm: Alarm, suspicion: Suspicion, verdict: Verdict, span: float, start: int, is_calm: bool) -> Alarm:
        """The alarm in words; a name has to go with the calm blocks as well, and with all that came before."""
        calm = suspicion.explain_calmly()
        is_told_apart = calm.causes[0].name == verdict.causes[0].name and calm.causes[0].name not in self._refuted
        return self._tell.alarm(alarm, verdict, calm, is_told_apart, span, suspicion.travel, start, is_calm, self.signature)

    def _change_of_known(self, suspicion: Suspicion, verdict: Verdict) -> _KnownFault | None:
        """The known fault whose end goes with what is measured about as well as any other explanation does."""
        best = max(part.log_factor for cause in verdict.causes for part in cause.parts)
        for each in self._known.values():
            if suspicion.log_factor(Explanation(each.place, 0, 0.0, -each.value, 0.0)) > best - ENDED:
                return each
        return None

    def _end_known(self, known: _KnownFault, start: int) -> list[Alarm]:
        """The known fault is there no more; an alarm that its end has raised was none."""
        del self._known[known.alarm.cause or ""]
        self._start_about_known()
        return [*self._end_open(start), replace(known.alarm, until=start)]

    def _end_open(self, start: int) -> list[Alarm]:
        """End the alarm that is being looked into, if there is one."""
        ended = self._tip_load.end(start) + ([] if self._alarm is None else [replace(self._alarm, until=start)])
        if self._alarm is not None:
            self._restart_holds()
        self._alarm, self._suspicion, self._unexplained, self._carried = None, None, None, {}
        self._afresh = ()
        self._detector.reset()
        return ended

    def _go_on_with(self, suspicion: Suspicion, verdict: Verdict) -> None:
        """The fault becomes known, if it has a name and a size that stays."""
        assert self._alarm is not None
        best, cause = verdict.best, self._alarm.cause
        is_sure = cause == verdict.causes[0].name and best.sigma < KNOWN_WITHIN * abs(best.value)
        others = (part.log_factor for part in verdict.causes[0].parts if part.place != best.place)
        is_told = max(others, default=-math.inf) < best.log_factor - KIND_TOLD * verdict.excess  # a scale is no bias elsewhere
        is_sure = is_sure and is_told
        if not is_sure or best.is_growing or suspicion.span < KNOWN_AFTER or any(suspicion.recent_fit(verdict)):
            return
        before = self._known.get(cause or "")
        if before is None:
            self._known[cause or ""] = _KnownFault(self._alarm, best.place, best.value, best.sigma)
        elif before.place == best.place:
            self._known[cause or ""] = replace(before, value=before.value + best.value)
        else:
            return
        self._alarm, self._suspicion, self._unexplained, self._carried = None, None, None, {}
        self._start_about_known()

    def _start_about_known(self) -> None:
        """Parameters are healthy but for the faults that are known."""
        self._regression = Regression(self._mean_about_known(), self._covariance_about_known())
        self._restart_holds()
        self._watch_anew()

    def _restart_holds(self) -> None:
        """Collect holds anew, with the faults that are known."""
        self._hold_test.restart([(each.place, CRUDE * each.value) for each in self._known.values()])

    def _mean_about_known(self) -> Array:
        """Of the parameters, with the faults that are known."""
        mean = self._mean.copy()
        for each in self._known.values():
            mean[each.place] += each.value
        return mean

    def _covariance_about_known(self) -> Array:
        """Of the parameters, with what the sizes of known faults are unsure by."""
        covariance = self.covariance.copy()
        for each in self._known.values():
            covariance[each.place, each.place] += each.sigma**2
        return covariance

    def forget(self) -> None:
        """Drop a suspicion that is not yet an alarm: a sensor has turned out to be faulty, and may have caused it."""
        if self._alarm is None and self._tip_load.alarm is None:
            self._suspicion, self._unexplained = None, None
            self._detector.reset()

    def close(self, stamp: int) -> list[Alarm]:
        """End the alarm that is being looked into, and that of holds, if there are any."""
        return self._end_open(stamp) + self._end_hold_alarm(stamp)
