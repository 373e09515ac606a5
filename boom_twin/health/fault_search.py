"""Fault twins: one twin for each fault hypothesis, and one of the boom as believed, on the same samples.

The filter of a twin gives the log likelihood of all readings (`BoomPredictor.evidence`). A fault twin has a scene with one
fault, or lets a sensor's zero drift. `causes` decides by the gains in likelihood. A named fault becomes part of the boom as
believed. So a second fault, and the end of the first, are named in the same way.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import repeat
from statistics import NormalDist
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..config.settings import Settings
from ..errors import BoomTwinError
from ..scene.schema import Scene
from ..types import SECOND, Alarm, Array, Change, Ranked, Stream, StrokeReading
from .causes import MEMORY, TEMPER, Evidence, Fault, Hypothesis, Verdict, evidence_of, hypothesis, possible_faults, usual_size
from .creep import SPAN, CreepMonitor
from .sensor_check import CAME_BACK, Flags

RATIO = 1.4  # of successive trial sizes of a named fault
IMPOSSIBLE = -1e9  # log likelihood of a boom that cannot be
DELAY = 2  # s from the end of a second to its verdict
SETTLING = 2  # s after a start without verdicts: the filters settle on vibration and zeros
WARM_UP = 10  # s of recent samples that new twins take first: they know neither motion nor zeros when they start


class Follower(Protocol):
    """Interface of a twin as far as fault twins need it; see `boom_twin.Twin`."""

    @property
    def evidence(self) -> float:
        """Log likelihood of all readings."""

    @property
    def doubts(self) -> int:
        """How often the estimate was doubted because its tip was far off the predicted one."""

    @property
    def requests(self) -> Any:
        """Requested changes that wait for the next stroke sample."""

    def take(self, block: Any, /) -> object:
        """Take the samples of a block."""

    def zeros(self, channels: Collection[str], /) -> tuple[Array, Array, Array]:
        """Estimated zeros of sensors, their variances, and deviations by errors of the scene."""

    def doubt(self, channels: Collection[str], /) -> None:
        """Let the zeros of these sensors drift by any amount."""

    def leave_out(self, masked: Flags, strokes: Flags, /) -> None:
        """Leave out measured channels, and strokes."""


class Second(NamedTuple):
    """Samples of a second that begins at `stamp` (ns), and the failing channels to leave out; or a change."""

    stamp: int
    block: Any = None
    left_out: tuple[Flags, Flags] | None = None
    change: Change | None = None


class FaultSearch:
    """Twins of all fault hypotheses: a call with a second of samples, or a change, returns the alarms that begin or end.

    Parameters
    ----------
    scene : Scene
        Boom with its load.
    make : callable
        Hypothesis -> its twin.
    settings : Settings
        With `name_odds` and `scene_error`.
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
        self._scene, self._make, self._settings, self._reads = scene, make, settings, reads
        self._sure = math.log(settings.name_odds / (1.0 - settings.name_odds))
        self._cores = ThreadPoolExecutor(threads, "fault twins")  # twins do not depend on each other
        self._recent: deque[Second] = deque(maxlen=MEMORY)
        self._change: Change | None = None
        self._creep = CreepMonitor(scene)
        self._named: dict[Fault, Alarm] = {}
        self._zeros_before: dict[str, tuple[int, float]] = {}  # place among a sensor's zeros, and its value before the onset
        self._begin()

    def _begin(self) -> None:
        """Make twins of the boom as believed, without each named fault (except ``off``), and with each other fault."""
        known = tuple(self._named)
        causes = {fault.cause for fault in known}
        fewer = [(fault, tuple(each for each in known if each is not fault)) for fault in known if fault.kind != "off"]
        more = [(fault, (*known, fault)) for fault in possible_faults(self._scene, self._reads) if fault.cause not in causes]
        faults, booms = zip((None, known), *fewer, *more, strict=True)
        found = [(fault, *each) for fault, each in zip(faults, self._cores.map(self._warm, booms), strict=True) if each]
        self._faults = [fault for fault, _, _ in found if fault is not None]
        self._hypotheses, self._twins = [each for _, each, _ in found], [twin for _, _, twin in found]
        self._decide_anew()

    def _warm(self, faults: Sequence[Fault]) -> tuple[Hypothesis, Follower] | None:
        """Return the hypothesis of these faults, and its twin after the newest seconds; None for an impossible boom."""
        try:
            each, twin = self._made(faults)
            for second in list(self._recent)[-WARM_UP:]:
                _feed(twin, each, second)
        except BoomTwinError:  # such as one with a part too soft to hold it
            return None
        return each, twin

    def _believe(self, fault: Fault, place: int = 0) -> None:
        """Let all twins go on if a sensor is off, with twin `place` as believed, or right (0); else begin anew."""
        if fault.kind != "off":
            return self._begin()
        channels = hypothesis(self._scene, (fault,)).doubted
        if place:
            self._twins[0], self._hypotheses[0] = self._twins.pop(place), self._hypotheses.pop(place)
            del self._faults[place - 1]
        doubted = [each.doubted | channels if place else each.doubted - channels for each in self._hypotheses]
        for i, (twin, own) in enumerate(zip(self._twins, doubted, strict=True)):
            twin.doubt(own)
            self._hypotheses[i] = self._hypotheses[i]._replace(doubted=own)
        if not place and (found := self._warm((*self._named, fault))) is not None:
            self._hypotheses.append(found[0])
            self._twins.append(found[1])
            self._faults.append(fault._replace(size=0.0))
        return self._decide_anew()

    def _decide_anew(self) -> None:
        """Discard all evidence of faults."""
        self._decision, self._age = Evidence(self._scene, self._faults, self._settings), 0
        self._certain = NormalDist().inv_cdf(1.0 - 0.5 * (1.0 - self._settings.name_odds) / len(self._faults))  # Bonferroni
        self._evidence = np.array([twin.evidence for twin in self._twins])

    def _made(self, faults: Sequence[Fault]) -> tuple[Hypothesis, Follower]:
        each = hypothesis(self._scene, faults)
        twin = self._make(each)
        if self._change is not None:
            twin.requests.repeat(_changed(self._change, each))
        return each, twin

    def close(self) -> None:
        """End the threads; a call that they work for fails."""
        self._cores.shutdown(cancel_futures=True)

    def __call__(self, second: Second) -> list[Alarm]:
        """Let all twins take a second or a change; return the alarms that begin or end."""
        if second.change is not None:
            self._recent.clear()
            self._change = second.change
            for each, twin in zip(self._hypotheses, self._twins, strict=True):
                twin.requests.repeat(_changed(second.change, each))
            self._decide_anew()
            return []
        if second.left_out is not None and self._is_newly_left_out(second.left_out):  # its last readings misled all states
            self._recent = deque((each._replace(left_out=second.left_out) for each in self._recent), MEMORY)
            self._begin()
        self._recent.append(second)
        leaks = [] if self._reads is StrokeReading.ANGLE else self._creep.take(second.stamp, second.block)
        if leaks:
            self._decide_anew()
        doubts = self._twins[0].doubts
        list(self._cores.map(_feed, self._twins, self._hypotheses, repeat(second)))  # waits for all, and raises what one raised
        if self._twins[0].doubts > doubts or math.isnan(self._twins[0].evidence):
            self._recent.clear()  # it has half forgotten zeros and load; any other would gain by what it still knows
            self._begin()
            return leaks
        return [*leaks, *self._decided(second.stamp)]

    def _is_newly_left_out(self, flags: tuple[Flags, Flags]) -> bool:
        """Return True if a sensor fails that no recent second leaves out."""
        before = [each.left_out for each in self._recent if each.left_out is not None]
        return bool(before) and any((now & ~np.any(then, axis=0)).any() for now, *then in zip(flags, *before, strict=True))

    def _decided(self, stamp: int) -> list[Alarm]:
        """Return the alarms of named faults that begin or end with the evidence of a second."""
        before, self._evidence = self._evidence, np.array([twin.evidence for twin in self._twins])
        grown = self._evidence - before
        grown[np.isnan(grown)] = np.nanmin(grown)  # a twin that diverged is as unlikely as the least likely one
        self._age += 1
        if self._age <= SETTLING:
            return []
        if (fault := self._back_again()) is not None:
            return self._ended(fault, stamp)
        verdict = self._decision.take(stamp, grown)
        return [] if verdict is None else self._name(verdict, stamp)

    def _name(self, verdict: Verdict, stamp: int) -> list[Alarm]:
        """Name the fault of a verdict, or end it if it is named; return its alarm.

        A leaking cylinder also looks softer. So one is named softer only after `SPAN`, in which a leak would show. One whose
        joint has a sensor that is off is not: that may be its stroke transducer. Rivals have their own most likely sizes.
        """
        fault, begin = self._faults[verdict.place], verdict.onset
        if fault in self._named:
            return self._ended(fault, begin)
        if fault.cause.startswith("cylinder_") and fault.kind == "softer":
            number = int(fault.channel.removeprefix("cylinder_"))
            is_off = any(each.cause == f"joint_{number}.sensor" for each in self._named)
            if is_off or number - 1 in self._creep.creeping or stamp - begin < SPAN * SECOND:
                return []
        found = self._sized(fault, begin)
        others = [self._sized(self._faults[each], begin) for each in verdict.rivals if found is not None]
        if found is None or any(each is not None and TEMPER * (found[3] - each[3]) < self._sure for each in others):
            self._decision.discard(verdict.place)
            return []
        sized, spread, onset, _ = found
        if fault.kind == "off" and abs(sized.size) < self._certain * spread:  # its zero still drifts
            return []
        ranked = tuple(Ranked(cause, chance, ()) for cause, chance in verdict.ranked)
        evidence = evidence_of(sized, spread) if fault.is_told else ""
        alarm = self._named[sized] = Alarm(fault.channel, fault.kind, onset, None, fault.cause, evidence, ranked)
        self._believe(fault, verdict.place + 1)
        return [alarm] if fault.is_told else []

    def _ended(self, fault: Fault, stamp: int) -> list[Alarm]:
        """End a named fault at a stamp (ns); return its alarm."""
        alarm = replace(self._named.pop(fault), until=stamp)
        self._believe(fault)
        return [alarm] if fault.is_told else []

    def _back_again(self) -> Fault | None:
        """Return a named sensor fault whose zero is nearly back at its value before the onset."""
        for fault in self._named:
            if fault.kind == "off":
                axis, before = self._zeros_before[fault.cause]
                now = self._twins[0].zeros(hypothesis(self._scene, (fault,)).doubted)[0]
                if abs(now[axis] - before) < CAME_BACK * abs(fault.size):
                    return fault
        return None

    def _sized(self, fault: Fault, onset: int) -> tuple[Fault, float, int, float] | None:
        """Return a fault of the most likely size, its deviation, its onset, not before `onset` (ns), and its gain since then.

        Twins of larger and smaller sizes follow the recent seconds until the likelihood falls on both sides. The deviation is
        that of the sizes without each second (jackknife), also where the model is inexact. None if the size is not surely above
        that of healthy booms, if a force's is below the set deviation, or if half the size is not likelier than none: the
        likelihood of a fault rises up to its size; a twin that opens another valve may jump.
        """
        usual = usual_size(self._scene, fault, self._settings.scene_error)
        if fault.kind == "off":
            changed, spread, drift = self._change_of_zero(fault, onset)
            spread = math.hypot(spread, usual)
            least = self._settings.force_deviation if fault.channel.startswith("cylinder_force_") else 0.0
            is_known = abs(changed.size) > max(least, self._certain * spread)
            return (changed, math.hypot(spread, drift), onset, 0.0) if is_known else None
        healthy = self._course(fault._replace(size=0.0), onset)

        def gained(size: float) -> Array:
            """Return the gain of a size by onset: the sum of those of the seconds from there."""
            gains = self._course(fault._replace(size=size), onset) - healthy
            return np.asarray(gains[::-1].cumsum()[::-1])

        sizes = [fault.size / RATIO, fault.size]
        gains = [gained(size) for size in sizes]
        while gains[-1].max() > gains[-2].max():
            sizes.append(RATIO * sizes[-1])
            gains.append(gained(sizes[-1]))
        while gains[0].max() > gains[1].max() and sizes[0] > self._certain * usual:
            sizes.insert(0, sizes[0] / RATIO)
            gains.insert(0, gained(sizes[0]))
        best = int(np.argmax([each.max() for each in gains]))
        if best == 0:
            return None
        first, changes = int(gains[best].argmax()), np.array(sizes[best - 1 : best + 2]) - sizes[best]
        curves, slopes, _ = np.polyfit(changes, [each[first:] for each in gains[best - 1 : best + 2]], 2)
        change = float(np.clip(-0.5 * slopes[0] / curves[0], changes[0], changes[2]))
        with np.errstate(divide="ignore", invalid="ignore"):  # nothing is left without the only second
            without = 0.5 * np.diff(slopes + 2.0 * curves * change, append=0.0) / (curves[0] + np.diff(curves, append=0.0))
        sized, spread = fault._replace(size=sizes[best] + change), math.hypot(float(np.linalg.norm(without)), usual)
        is_likely = sized.size > self._certain * spread and TEMPER * gained(0.5 * sized.size)[first] > self._sure
        return (sized, spread, onset + first * SECOND, float(gains[best][first])) if is_likely else None

    def _course(self, fault: Fault, onset: int) -> Array:
        """Return the log likelihood of each recent second since the onset; `IMPOSSIBLE` for an impossible boom."""
        total, found = 0.0, list[float]()
        try:
            for stamp, twin in self._repeated(fault):
                found += [twin.evidence - total] * (stamp >= onset)
                total = twin.evidence
        except BoomTwinError:
            return np.full(sum(second.stamp >= onset for second in self._recent), IMPOSSIBLE)
        return np.nan_to_num(found, nan=IMPOSSIBLE)

    def _change_of_zero(self, fault: Fault, onset: int) -> tuple[Fault, float, float]:
        """Return a sensor fault with its zero's change since the onset (IMU: clearest axis), the standard deviation, the drift.

        An angle sensor has no zero before, so its change may be older than the evidence. The drift is the change in the newest
        `DELAY`: a zero that still drifts has changed by as much again when the verdict comes.
        """
        doubted, before = hypothesis(self._scene, (fault,)).doubted, tuple(np.zeros((3, 1)))
        zeros = [(stamp, twin.zeros(doubted)) for stamp, twin in self._repeated(fault)]
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

    def _repeated(self, fault: Fault) -> Iterator[tuple[int, Follower]]:
        """Run a twin with a fault over the recent seconds; yield each stamp with the twin after that second."""
        each, twin = self._made((*self._named, fault))
        for second in self._recent:
            _feed(twin, each, second)
            yield second.stamp, twin


def _feed(twin: Follower, each: Hypothesis, second: Second) -> None:
    if second.left_out is not None:
        twin.leave_out(*second.left_out)
    twin.take(_in_time(second.block, each))


def _in_time(block: Any, each: Hypothesis) -> Any:
    """Return a block with stamps corrected by the delays of a hypothesis, in the order of time."""
    if not each.delays:
        return block
    stamps = block.stamps.copy()
    for stream, delay in each.delays:
        stamps -= round(delay * SECOND) * (block.streams == list(Stream).index(stream))
    order = np.argsort(stamps, kind="stable")
    return block._replace(streams=block.streams[order], stamps=stamps[order], values=block.values[order])


def _changed(change: Change, each: Hypothesis) -> Change:
    """Return a change with the load of a hypothesis."""
    load = each.load(change.settings["payload"], change.settings["line_fill"])
    return replace(change, settings=change.settings | load)
