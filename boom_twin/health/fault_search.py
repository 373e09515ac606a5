"""Fault twins: one twin for each fault hypothesis, and one of the boom as believed, on the same samples.

The filter of a twin gives its innovations and the log likelihood of all readings (`BoomPredictor.evidence`). A fault twin has a
scene with one fault, or lets a sensor's zero drift. `causes` decides which fault is probable. Further twins find its size. A
named fault becomes part of the boom as believed. So a second fault is found in the same way.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import repeat
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from ..config.settings import Settings
from ..scene.schema import Scene
from ..types import SECOND, Alarm, Array, Ranked, Stream, StrokeReading
from .causes import INDEPENDENT, MEMORY, Evidence, Verdict, likeliest, scores
from .deviations import CREEP_SPAN, CreepMonitor
from .faults import (
    QUIET,
    Fault,
    Follower,
    Hypothesis,
    Second,
    TwinMaker,
    evidence_of,
    feed,
    hypothesis,
    possible_faults,
    usual_size,
)
from .sensor_check import CAME_BACK

DELAY = 2  # s from the end of a second to its verdict
SETTLING = 2  # s after a start without verdicts: the filters settle on vibration and zeros


class SizedFault(NamedTuple):
    """Fault of its most likely size.

    spread : standard deviation of the size. onset, whole : stamps (ns) from which the boom has the fault, and all of it.
    probability : log posterior, up to a constant common to all faults.
    """

    fault: Fault
    spread: float
    onset: int
    whole: int
    probability: float


class EndTest:
    """Test for the end of a named fault, by twins of the boom as believed and of that boom without the fault.

    A twin learns zeros and a load that fit its boom. What it learned before an end misleads it afterwards. So each second both
    twins restart from the `SETTLING` seconds before, until the boom without the fault is likelier since their start (E. Page,
    Biometrika 41 (1954), 100-115).
    """

    def __init__(self, maker: TwinMaker, known: tuple[Fault, ...], fault: Fault) -> None:
        self.fault, self._maker = fault, maker
        self._booms = known, tuple(each for each in known if each is not fault)
        self._pair: list[tuple[Hypothesis, Follower]] = []
        self._recent: deque[Second] = deque(maxlen=SETTLING + 1)
        self._sum = 0.0  # evidence since the twins' start

    def gain(self, second: Second, sure: float) -> float:
        """Return the log likelihood of a second without the fault less that with it; `sure` bounds its share of the sum."""
        self._recent.append(second)
        seconds = [second]
        if not self._sum > 0.0:
            self._sum, self._pair, seconds = 0.0, [self._maker.twin(boom) for boom in self._booms], [*self._recent]
        for each in seconds:
            before = [twin.evidence for _, twin in self._pair]
            for own, twin in self._pair:
                feed(twin, own, each)
        believed, without = (twin.evidence - old for (_, twin), old in zip(self._pair, before, strict=True))
        if len(self._recent) > SETTLING:
            self._sum += min(max(INDEPENDENT * (without - believed), -sure), sure)
        return without - believed


class FaultSearch:
    """Twins of all fault hypotheses: a call with a second of samples, or a change, returns the alarms that begin or end.

    Parameters
    ----------
    scene : Scene
        Boom with its load.
    make : callable
        Hypothesis -> its twin.
    settings : Settings
        `name_odds` and `scene_error` are used.
    reads : StrokeReading
        Quantity that drives the model.
    """

    def __init__(
        self,
        scene: Scene,
        make: Callable[[Hypothesis], Follower],
        settings: Settings,
        reads: StrokeReading = StrokeReading.LENGTH,
        threads: int = 1,  # among which the twins are shared
    ) -> None:
        self._scene, self._settings, self._reads = scene, settings, reads
        self._maker = TwinMaker(scene, make, MEMORY)
        self._cores = ThreadPoolExecutor(threads, "fault twins")  # twins do not depend on each other
        self._creep = CreepMonitor(scene)
        self._named: dict[Fault, Alarm] = {}
        self._zeros_before: dict[str, tuple[int, float]] = {}  # place among a sensor's zeros, and its value before the onset
        self._streams: set[Stream] = set()  # those that have come
        self._hypotheses: list[Hypothesis] = []
        self._twins: list[Follower] = []  # made when the first streams have come

    def _begin(self, since: int = 0) -> None:
        """Make twins of the boom as believed since a stamp (ns), and of that boom with each other fault; discard all evidence.

        All take the recent seconds since then, which are evidence like those to come. A further twin of a named fault that has
        a size lets that size grow or shrink. The end of a sensor fault shows in its estimated zero.
        """
        known = tuple(self._named)
        causes = {fault.cause for fault in known if not fault.is_size}
        possible = [each for each in possible_faults(self._scene, self._reads, self._streams) if each.cause not in causes]
        made = list(self._cores.map(self._maker.possible, [known, *((*known, fault) for fault in possible)]))
        self._faults = [fault for fault, each in zip(possible, made[1:], strict=True) if each is not None]
        self._hypotheses, self._twins = map(list, zip(*(each for each in made if each is not None), strict=True))
        self._ends = [EndTest(self._maker, known, fault) for fault in known if fault.kind != "off"]
        faults = [*self._faults, *(each.fault._replace(kind="ended") for each in self._ends)]
        self._certain = NormalDist().inv_cdf(1.0 - 0.5 * (1.0 - self._settings.name_odds) / len(faults))  # Bonferroni
        errors = [usual_size(self._scene, fault, self._settings.scene_error) for fault in faults]
        named = {fault.cause for fault in known}
        self._decision, self._age = Evidence(self._scene, faults, self._settings, errors, self._certain, named), -SETTLING
        self._unsure: dict[int, float] = {}  # evidence of faults below which their sizes are not looked for again
        self._evidence, self._quiet = np.zeros(len(self._twins)), 0.0
        self._maker.forget(since)
        for second in self._maker.recent:
            self._feed(second)
            self._weigh(second)
        self._quiet = 0.0  # evidence that the filters expect too much unknown force; that of these seconds has been used

    def close(self) -> None:
        """End the threads; a call that they work for fails."""
        self._cores.shutdown(cancel_futures=True)

    def __call__(self, second: Second) -> list[Alarm]:
        """Let all twins take a second or a change; return the alarms that begin or end."""
        if second.change is not None:
            self._maker.restart(second.change)
            if self._twins:
                self._begin()
            return []
        come = {list(Stream)[code] for code in np.unique(second.block.streams)}
        is_other = not come <= self._streams
        self._streams |= come
        if second.left_out is not None and self._maker.is_news(second.left_out):  # its last readings misled all states
            self._maker.leave_out(second.left_out)
            is_other = True
        if is_other:
            self._begin()
        self._maker.recent.append(second)
        leaks = [] if self._reads is StrokeReading.ANGLE else self._creep.take(second.stamp, second.block)
        if leaks:
            self._begin(second.stamp + SECOND)
        doubts = self._twins[0].doubts
        self._feed(second)
        if self._twins[0].doubts > doubts or math.isnan(self._twins[0].evidence):
            self._begin(second.stamp + SECOND)  # it has half forgotten zeros and load; others would gain by what they know
            return leaks
        verdict = self._weigh(second)
        if (fault := self._back_again()) is not None:
            return [*leaks, *self._ended(fault, second.stamp)]
        if self._quiet > self._decision.sure:  # filters that expect too much load follow noise, and a load would pay
            self._maker.expects *= QUIET
            self._begin()
            return leaks
        return [*leaks, *([] if verdict is None else self._name(verdict, second.stamp))]

    def _feed(self, second: Second) -> None:
        """Let all twins take a second."""
        list(self._cores.map(feed, self._twins, self._hypotheses, repeat(second)))  # waits for all, and raises what one raised

    def _weigh(self, second: Second) -> Verdict | None:
        """Add the evidence of a second that all twins have taken; return the verdict if a fault, or an end, is probable."""
        innovations = [twin.take_innovations() for twin in self._twins]
        before, self._evidence = self._evidence, np.array([twin.evidence for twin in self._twins])
        grown = self._evidence - before
        grown = np.append(grown, [grown[0] + each.gain(second, self._decision.sure) for each in self._ends])
        grown[np.isnan(grown)] = np.nanmin(grown)  # a twin that diverged is as unlikely as the least likely one
        self._age += 1
        if self._age <= 0:
            return None
        quieter = next((place for place, each in enumerate(self._faults, 1) if each.kind == "quieter"), 0)
        self._quiet += INDEPENDENT * float(grown[quieter] - grown[0])
        sized = [(each, fault.size) for each, fault in zip(innovations[1:], self._faults, strict=True) if fault.is_size]
        return self._decision.take(second.stamp, grown, scores(innovations[0], *zip(*sized, strict=True)))

    def _name(self, verdict: Verdict, stamp: int) -> list[Alarm]:
        """Name the fault of a verdict, change its size, or end it; return its alarm if it begins or ends.

        Far from the boom as believed, innovations are not linear in sizes. So twins find the size of each ranked fault. The
        most likely one, each at its own size, is named by the odds required for a name. Otherwise all are sized again once
        the evidence has grown by these odds.
        """
        begin = verdict.onset
        if verdict.place >= len(self._faults):
            return self._ended(self._ends[verdict.place - len(self._faults)].fault, begin)
        fault = self._faults[verdict.place]
        is_softer = fault.kind == "softer" and verdict.sizes[verdict.place] > 0.0
        if (is_softer and self._may_leak(fault, stamp - begin)) or verdict.evidence < self._unsure.get(verdict.place, 0.0):
            return []
        faults = {verdict.place: fault}
        for place, size in verdict.sizes.items() if fault.is_size else ():
            faults[place] = self._faults[place]._replace(size=math.copysign(self._faults[place].size, size))
        # of size 0 all are the boom as believed
        healthy = np.zeros(0) if fault.kind == "off" else self._course(fault._replace(size=0.0))
        found = {place: each for place, trial in faults.items() if (each := self._sized(trial, begin, healthy)) is not None}
        likely = {place: each.probability for place, each in found.items()}
        best = max(likely, key=lambda place: likely[place], default=verdict.place)
        rivals = [likely[best] - each for place, each in likely.items() if place != best]
        if verdict.place not in found or min(rivals, default=math.inf) < self._decision.sure:
            self._unsure[verdict.place] = verdict.evidence + self._decision.sure
            return []
        sized = found[best]
        if fault.kind == "off" and abs(sized.fault.size) < self._certain * sized.spread:  # its zero still drifts
            return []
        if (before := next((each for each in self._named if each.cause == sized.fault.cause), None)) is not None:
            return self._changed_size(before, sized)
        named = sized.fault.signed()
        evidence = evidence_of(named, sized.spread) if named.is_told else ""
        part = (named.kind, named.size, sized.spread, named.unit)
        ranked = verdict.ranked if len(likely) == 1 else self._ranked(verdict, likely)
        causes = tuple(Ranked(cause, p, (part,) if cause == named.cause else ()) for cause, p in ranked)
        alarm = self._named[named] = Alarm(named.channel, named.kind, sized.onset, None, named.cause, evidence, causes)
        self._begin(sized.whole)  # the seconds before were of another boom
        return [alarm] if named.is_told else []

    def _ranked(self, verdict: Verdict, likely: dict[int, float]) -> list[tuple[str, float]]:
        """Return causes of certain size by their posterior probabilities, then the rest as `UNKNOWN`."""
        unknown, rest = verdict.ranked[-1]
        weights = {place: math.exp(each - max(likely.values())) for place, each in likely.items()}
        share = (1.0 - rest) / sum(weights.values())
        found = [(self._faults[place].cause, share * weight) for place, weight in weights.items()]
        return [*sorted(found, key=lambda each: -each[1]), (unknown, rest)]

    def _may_leak(self, fault: Fault, age: int) -> bool:
        """Return True if an apparent softer spring of this `age` (ns) may be a leak, or a stroke transducer that is off.

        A leak would show within `CREEP_SPAN`. A named sensor fault of the joint may be one of its stroke transducer.
        """
        if not fault.cause.startswith("cylinder_"):
            return False
        number = int(fault.channel.removeprefix("cylinder_"))
        is_off = any(each.cause == f"joint_{number}.sensor" for each in self._named)
        return is_off or number - 1 in self._creep.creeping or age < CREEP_SPAN * SECOND

    def _changed_size(self, named: Fault, change: SizedFault) -> list[Alarm]:
        """Change the size of a named fault; if the rest is that of a healthy boom, end the fault and return its alarm."""
        left = named.changed_by(change.fault)
        usual = usual_size(self._scene, left, self._settings.scene_error)
        if abs(left.size) < self._certain * math.hypot(change.spread, usual):
            return self._ended(named, change.onset)
        self._named[left] = self._named.pop(named)
        self._begin(change.whole)
        return []

    def _ended(self, fault: Fault, stamp: int) -> list[Alarm]:
        """End a named fault at a stamp (ns); return its alarm."""
        alarm = replace(self._named.pop(fault), until=stamp)
        self._begin(stamp)
        return [alarm] if fault.is_told else []

    def _back_again(self) -> Fault | None:
        """Return a named sensor fault whose zero has nearly returned to its value before the onset."""
        for fault in self._named:
            if fault.kind == "off":
                axis, before = self._zeros_before[fault.cause]
                now = self._twins[0].zeros(hypothesis(self._scene, (fault,)).doubted)[0]
                if abs(now[axis] - before) < CAME_BACK * abs(fault.size):
                    return fault
        return None

    def _sized(self, fault: Fault, onset: int, healthy: Array) -> SizedFault | None:
        """Return the fault of the most likely size.

        `healthy` is the course of the boom as believed, and `onset` that of a sensor's zero, which does not depend on it. The
        boom does not change by a sensor, so it counts as whole from the beginning.
        Return None if the size is not certainly above that of healthy booms, if the seconds do not agree, or if the size of a
        force fault is below `Settings.force_deviation`.
        """
        usual = usual_size(self._scene, fault, self._settings.scene_error)
        if fault.kind == "off":
            changed, spread, drift = self._change_of_zero(fault, onset)
            spread = math.hypot(spread, usual)
            least = self._settings.force_deviation if fault.channel.startswith("cylinder_force_") else 0.0
            is_known = abs(changed.size) > max(least, self._certain * spread)
            return SizedFault(changed, math.hypot(spread, drift), onset, 0, 0.0) if is_known else None
        least, sure = self._certain * usual, self._decision.sure
        found = likeliest(fault.size, least, sure, lambda size: self._course(fault._replace(size=size)) - healthy)
        if found is None:
            return None
        spread = math.hypot(found.spread, usual)
        is_known = abs(found.size) > self._certain * spread and found.agreement > math.sqrt(2.0 * sure)
        begun, whole = (list(self._maker.recent)[-self._age :][each].stamp for each in (found.onset, found.whole))
        return SizedFault(fault._replace(size=found.size), spread, begun, whole, found.probability) if is_known else None

    def _course(self, fault: Fault) -> Array:
        """Return the log likelihood of each second that counts as evidence, with a fault beside the named ones."""
        return self._maker.course((*self._named, fault), self._age)

    def _change_of_zero(self, fault: Fault, onset: int) -> tuple[Fault, float, float]:
        """Return a sensor fault with its zero's change since the onset (IMU: clearest axis), the standard deviation, the drift.

        The zero of an angle sensor counts from 0, because its change may be older than the evidence. The drift is the change in
        the newest `DELAY`. A zero that still drifts will have changed by as much again when the verdict comes.
        """
        doubted, before = hypothesis(self._scene, (fault,)).doubted, tuple(np.zeros((3, 1)))
        zeros = [(stamp, twin.zeros(doubted)) for stamp, twin in self._maker.repeated((*self._named, fault))]
        now = zeros[-1][1]
        drift = now[0] - zeros[-1 - min(DELAY, len(zeros) - 1)][1][0]
        if fault.channel.startswith("joint_"):
            now = self._twins[self._faults.index(fault) + 1].zeros(doubted)
        else:
            before = [each for stamp, each in zeros if stamp < onset or stamp == zeros[0][0]][-1]
        change, spread = now[0] - before[0], np.sqrt(now[1] + before[1] + (now[2] - before[2]) ** 2)
        axis = int(np.argmax(np.abs(change) / spread))
        self._zeros_before[fault.cause] = axis, float(before[0][axis])
        return fault._replace(size=float(change[axis])), float(spread[axis]), float(drift[axis])
