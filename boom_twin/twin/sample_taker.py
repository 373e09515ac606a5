"""Decisions about single samples of a twin: follow or refuse them, start and restart the model, apply changes between them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..config.settings import Settings
from ..deviation.predictor import BoomPredictor
from ..errors import BoomTwinError, SolverError, UsageError
from ..health.fault_twins import FaultTwins
from ..health.faults import Follower, Hypothesis
from ..health.monitor import HealthMonitor
from ..kernels.tables import SENTENCES
from ..scene.edit import loaded
from ..scene.load import SceneSource, as_scene
from ..types import (
    LIMIT,
    NANO,
    NO_CHANNELS,
    NO_PLACES,
    SECOND,
    Array,
    Change,
    Channel,
    Mount,
    Place,
    Sample,
    Stream,
    StrokeReading,
    channels_of,
    streams_of,
)
from .adjustments import Requests, ResidualBuffer, SensorZeros, limits_of
from .block_update import BlockUpdate
from .blocks import CODES, REGULAR, Note, ReportBlock, SampleBlock
from .run import Run, StampCheck, verdict_on
from .sample_check import SampleCheck
from .state import (
    FOLLOWER_ROOM,
    NEWEST,
    NONE,
    ROOM,
    SHORTEST_STEP,
    STATUS,
    UNMATCHED,
    drop_waiting,
    near,
    new_state,
    note_stamp,
)
from .update import DONE, FAILED


class SampleTaker:
    """State and model of a twin, changed by single samples; `boom_twin.twin.twin.Twin` is the public interface."""

    _boom: BoomPredictor

    def __init__(
        self,
        scene: SceneSource = None,
        settings: Settings | None = None,
        mounts: Sequence[Mount | None] = (),
        health: bool = False,
        reads: StrokeReading = StrokeReading.LENGTH,
        absent: Collection[str] = (),
        doubted: Collection[str] = (),
        causes: bool = False,
        is_live: bool = False,
        places: Mapping[str, Place] = NO_PLACES,
        lagging: Collection[Stream] = (),
        is_follower: bool = False,
        declared: Mapping[str, Channel] = NO_CHANNELS,
    ) -> None:
        self.reads, self._drive, self.absent, scene = reads, reads.stream, frozenset(absent), as_scene(scene)
        if not isinstance(settings, Settings | None):
            raise UsageError(f"settings = {settings!r}: give Settings(name=value, ..), load_settings(FILE), or None.")
        self.scene, self.settings, self._health = scene, settings or Settings(), health
        self.counts: Counter[str] = Counter()
        self.mounts = tuple(mounts) or (None,) * len(scene.joints)
        self.places, self.lagging, self._declared = dict(places), tuple(lagging), declared
        self._channels = channels_of(len(scene.joints), streams_of(self.places))
        self.absent |= {name for name in self._channels[Stream.MOMENTS] if name not in self.places}
        self._there = {s: np.array([name not in absent for name in names]) for s, names in self._channels.items()}
        self._widths = [len(names) for names in self._channels.values()]
        self._sample_check = SampleCheck(self._channels, self._drive)
        self.requests = Requests(self.settings)
        self._doubted, self._is_follower = frozenset(doubted), is_follower
        self._room = FOLLOWER_ROOM if is_follower else ROOM
        self._judged = True  # health, with the present sample
        self._fault_twins: FaultTwins | None = None
        if causes and health:
            sensors = {"reads": reads, "absent": self.absent, "places": self.places, "lagging": self.lagging}
            make = partial(_follower, type(self), self.settings, self.mounts, sensors)
            self._fault_twins = FaultTwins(self.scene, make, self.settings, is_live, reads)
        self._begin()

    def _begin(self) -> None:
        self._state = new_state(len(self.scene.joints), np.array(self._widths), self._room)
        self._state.clock[NEWEST] = NONE
        self._make_model()
        self._run: Run | None = None
        self._is_new = True
        self._failed: int | None = None
        self._line = StampCheck(self.settings, self._state, CODES[self._drive])
        self._zeros = SensorZeros(self._state, self._channels, self._drive)
        self._recent = ResidualBuffer(self._state.recent, self._channels)

    def _failing(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        assert self.judge is not None
        return self.judge.suspected, self.judge.failing_strokes

    def leave_out(self, masked: NDArray[np.bool_], strokes: NDArray[np.bool_]) -> None:
        self._boom.leave_out(masked, strokes, np.zeros_like(strokes))

    def _restart(self) -> None:
        self._end_run()
        self._line = StampCheck(self.settings, self._state, CODES[self._drive])
        self._state.newest[:], self._state.usual[:] = NONE, 0.0
        self._state.waiting.bounds[:] = 0

    def _make_model(self) -> None:
        """Make the parts of the model that depend on the load."""
        settings, scene = self.settings, loaded(self.scene, *self.settings.load)
        boom = BoomPredictor(scene, settings, self.mounts, self.reads, self.places, self.lagging)
        boom.sensors.doubt(self._doubted)
        judge: HealthMonitor | None = None
        if self._health:
            sensors = self.mounts, self.absent, boom.channels, self.reads, self.places, self._declared
            judge = HealthMonitor(scene, settings, *sensors)
            judge.fault_twins = self._fault_twins
        self._boom, self.plan, self.judge = boom, boom.plan, judge
        limits = limits_of(self.scene, boom, settings, self.absent, self.reads)
        parts = boom, limits, self._state, self._channels, judge
        self._compiled = BlockUpdate(*parts, self.counts, self._room.samples, not self._is_follower)
        self._one = SampleBlock(np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros((1, max(self._widths))))

    def _take_over(self, stamp: int) -> list[str]:
        """Apply the requested changes; return the events. Another load, or other zeros of strokes, need a start from rest."""
        asked, before = self.requests, self.settings
        is_new = asked.is_new and self._run is not None
        from_rest, self.settings = asked.take(), asked.settings
        if is_new:
            self._begin()
            before = self.settings
        events = ["load"] if before.load != self.settings.load else []
        if before.limits != self.settings.limits:
            events.append("limits")
            self._compiled.limits = limits_of(self.scene, self._boom, self.settings, self.absent, self.reads)
            self._line.tune(self.settings)
        if asked.zeros != self._zeros.values:
            events.append("zero")
            from_rest |= self._zeros.put(stamp, asked.zeros)
        if (from_rest or "load" in events) and self._run is not None:
            events += [] if events else ["reset"]
            self._end_run_at(stamp)
        if "load" in events:
            lags = self._boom.filters.lags
            self._make_model()
            self._boom.filters.lags[:] = lags
        return events

    def _end_run_at(self, stamp: int) -> None:
        """End the run; the next one starts with the strokes of `stamp` (ns). Measured samples from then on still wait."""
        self._end_run()
        drop_waiting(self._state, NONE, stamp - 1)

    def _end_run(self) -> None:
        self._run = None
        self._state.clock[NEWEST] = NONE
        self._state.past.bounds[:] = 0
        self._zeros.forget_past()
        self._recent.clear()
        self._compiled.begin_health()

    def _advance_one(self, sample: Sample, trusted: bool = False) -> int:
        one = self._one
        one.streams[0], one.stamps[0], one.values[0, : len(sample.values)] = CODES[sample.stream], sample.stamp, sample.values
        reason, _ = self._compiled.advance(self._run, one, trusted)
        return reason

    def _decide(self, sample: Sample) -> ReportBlock:
        """Follow, compare or refuse a sample that may be irregular. It is copied, since the caller's arrays may change."""
        self._compiled.make_room()
        sample = replace(sample, values=sample.values.copy())
        complete = self._is_complete(sample)
        if not complete:
            usable = np.abs(sample.values) <= LIMIT
            if not usable.any():
                return self._refuse(sample, "empty")
            sample = replace(sample, values=np.where(usable, sample.values, np.nan))
        if sample.stream is self._drive:
            return self._take_strokes(sample, complete)
        if sample.stream is Stream.STROKES:
            return self._refuse(sample, "not used")
        return self._take_measured(sample, complete)

    def _take_strokes(self, sample: Sample, complete: bool) -> ReportBlock:
        line, run, values = self._line, self._run, self._zeroed(sample)
        if run is None:
            return self._follow(sample, values, complete, [])
        if line.is_next(sample.stamp) and sample.stamp - run.newest >= SHORTEST_STEP:
            if run.is_of_others(sample.stamp, values, self._boom.expected(values), self._compiled.limits):
                return self._refuse(sample, "implausible")
            return self._follow(sample, values, complete, [])
        verdict = verdict_on(sample, values, line, run, self._boom, self._compiled.limits, self.settings)
        if not verdict.is_followed:
            return self._refuse(sample, verdict.event, is_noted=verdict.is_noted)
        if verdict.event:
            line.change_over()
        if verdict.event == "gap":
            self._boom.add_phase()  # stamps do not tell a pause from a clock that was set
        elif verdict.event:
            self._restart()
            values = self._zeroed(sample)
        return self._follow(sample, values, complete, [verdict.event] if verdict.event else [])

    def _zeroed(self, sample: Sample) -> Array:
        """Return strokes or angles that drive the model, less their zeros; of inclinometers, the turn next to the estimate."""
        values = sample.values - self._zeros.of_drive(sample.stamp)
        if self._run is None:
            return values
        expected = self._boom.extrapolated(0.0)
        return np.where(self._compiled.limits.turns, near(values, expected, True), values)

    def _follow(self, sample: Sample, values: Array, complete: bool, events: list[str]) -> ReportBlock:
        """Step to a stroke sample, whose `values` are without the sensors' zeros; start the model if it has not started."""
        if not complete:
            events.append("partial")
        asked = complete and self.requests.due
        if asked:
            events += self._take_over(sample.stamp)
            values = self._zeroed(sample)
        limits = self._compiled.limits
        if ((values < limits.shortest) | (values > limits.longest)).any():
            events.append("out of range")
        sample = replace(sample, values=values)
        if self._run is not None:
            report, from_rest = self._step(self._run, sample, events), False
        elif complete and (self._failed is None or asked or abs(sample.stamp - self._failed) >= SECOND):
            report, from_rest = self._start(sample, events), True
        else:
            return self._refuse(sample, "waiting", *events)
        note = report.notes.get(0, REGULAR)
        has_begun = from_rest and note.accepted
        if asked or has_begun:
            change = Change(sample.stamp, from_rest, self.settings.live, self._zeros.values, from_rest and self._is_new)
            self._is_new &= not has_begun
            return report._replace(notes={0: note._replace(change=change)})
        return report

    def _start(self, sample: Sample, events: list[str]) -> ReportBlock:
        try:
            sample = replace(sample, values=self._boom.start(sample.values, self._is_follower or not self._is_new))
        except BoomTwinError as error:
            self._failed = sample.stamp if isinstance(error, SolverError) else self._failed
            return self._refuse(sample, "model", *events, status=str(error))
        self._run = Run(self._state, sample.stamp, not self._is_new)
        return self._step(self._run, sample, events)

    def _step(self, run: Run, sample: Sample, events: list[str]) -> ReportBlock:
        self._line.take(sample.stamp)
        estimate = self._boom.expected(sample.values) if run.is_predicted else None
        before, rates = self._state.strokes, self._boom.speeds
        taken, oddities = run.checked(sample.stamp, sample.values, before, estimate, rates, self._compiled.limits)
        if run.must_restart and np.isfinite(sample.values).all():
            self._end_run_at(sample.stamp)
            return self._follow(sample, sample.values, True, [*events, "stroke elsewhere"])
        run.is_predicted = True
        events += oddities
        self._state.strokes[:], self._state.taken[:] = sample.values, taken
        if self._advance_one(sample, trusted=True) == FAILED:
            return self._fail(sample, events)
        self.counts.update(events)
        return self._compiled.rows(np.array([sample.stamp]), events, self._judged)

    def _fail(self, sample: Sample, events: list[str]) -> ReportBlock:
        self._restart()
        self._failed = sample.stamp
        return self._refuse(sample, "model", *events, status=SENTENCES[int(self._state.clock[STATUS])])

    # -- measured angles and accelerations ----------------------------------------------------------------------------

    def _take_measured(self, sample: Sample, complete: bool) -> ReportBlock:
        state, stream, run = self._state, CODES[sample.stream], self._run
        span = 1.0 if state.newest[stream] == NONE else (sample.stamp - int(state.newest[stream])) * NANO
        if -self.settings.jump_back <= span <= 0.0:
            return self._refuse(sample, "duplicate" if span == 0.0 else "late")
        if run is not None and abs(sample.stamp - run.newest) * NANO > self.settings.restart_gap:
            return self._refuse(sample, "leap")  # no strokes come at that time
        if span < 0.0:  # time was set back, as in a looped bag: waiting samples are of the time before
            state.clock[UNMATCHED] += drop_waiting(state, sample.stamp, -NONE, stream)
            state.newest[stream] = NONE
        return self._compare(sample, complete)

    def _compare(self, sample: Sample, complete: bool) -> ReportBlock:
        note_stamp(self._state, CODES[sample.stream], sample.stamp)
        events: tuple[str, ...] = ()
        if not complete:
            events = ("partial",)
            self.counts.update(events)
        if self._advance_one(sample, trusted=True) != DONE:
            return self._refuse(sample, "unmatched", *events)
        return self._compiled.rows(np.array([sample.stamp]), events)

    def _refuse(self, sample: Sample, *events: str, status: str = "ok", is_noted: bool = False) -> ReportBlock:
        """Return the report of a sample whose values are not used. If `is_noted`, its stamp is used."""
        self.counts.update(events)
        return self._compiled.no_rows(sample.stamp, Note(is_noted, events, status))

    def _is_complete(self, sample: Sample) -> bool:
        return bool((np.abs(sample.values) <= LIMIT)[self._there[sample.stream]].all())


def _follower(kind: Any, settings: Settings, mounts: tuple[Mount | None, ...], sensors: Any, each: Hypothesis) -> Follower:
    """Return the fault twin of a hypothesis, of class `kind`."""
    own = settings.tuned(each.load(*settings.load))
    own = own.model_copy(update={"expected_load": each.expects * own.expected_load})
    twin: Follower = kind(each.scene, own, mounts, **sensors, doubted=each.doubted, is_follower=True)
    return twin
