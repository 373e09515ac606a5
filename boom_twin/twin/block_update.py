"""Call the compiled update with blocks of samples, and make reports of the rows that it gives."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..deviation.predictor import BoomPredictor, Drawn
from ..health.blocks import MeasuredRows, PredictionRows
from ..health.monitor import HealthMonitor
from ..kernels.jit import hold
from ..kernels.result_row import PIN
from ..predictions import Outline
from ..types import Health, Report, Residuals, Stream
from .blocks import CODES, STREAMS, EstimateBlock, PredictionBlock, ReportBlock, ResidualBlock, SampleBlock, estimate_of
from .run import Run
from .state import BEGINS_SLOT, IS_DEFLECTED, ROOM, SLOT, UNMATCHED, Limits, TwinState, UpdateOutput, new_output
from .update import DONE, LOOK, update


@dataclass
class _UpdateExtras:
    """Results of one call that are not numbers: `drawn` by row of a prediction, `health` and `events` by row of a sample."""

    drawn: dict[int, Drawn] = field(default_factory=dict)
    health: dict[int, Health] = field(default_factory=dict)
    events: dict[int, tuple[str, ...]] = field(default_factory=dict)


NO_EXTRAS = _UpdateExtras()
_Code = Callable[..., tuple[int, int]]  # `update`, compiled for a scene's types
_Held = tuple[_Code, tuple[Any, ...], Any]  # with boom, limits and state, and output, see `boom_twin.kernels.jit.hold`


SHAPES_ABOVE, HEALTH_ABOVE = 0.5, 0.75
"""Share of the queue of samples that is filled, above which shapes and then health too are left out; at 1 samples are lost."""


class LoadShedding:
    """Decision, by the fill level of the sample queue, what to skip: shapes first, then the judgement of health.

    Predictions, estimates and residuals are never skipped, and do not depend on what is. A sensor that fails meanwhile is
    detected late: until then the estimate still uses it. A replay has no queue and skips nothing. `shapes` and `health` count
    what was left out.
    """

    def __init__(self) -> None:
        self.shapes = self.health = 0
        self._share = 0.0

    def filled(self, share: float) -> None:
        """Set the fill level of the queue, 0 to 1, when the next sample is taken."""
        self._share = share

    def leaves_out_shape(self) -> bool:
        """Return True if the shape that is due must be skipped; count it."""
        self.shapes += (is_due := self._share > SHAPES_ABOVE)
        return is_due

    def leaves_out_health(self) -> bool:
        """Return True if the judgement of the rig's health that is due must be skipped; count it."""
        self.health += (is_due := self._share > HEALTH_ABOVE)
        return is_due


class BlockUpdate:
    """Driver of the compiled update, for regular samples.

    `channels`: see `boom_twin.types.channels_of`. ``deflected`` and ``unmatched`` are added to `counts`. `shedding` is asked
    what is left out. One call takes at most `capacity` samples. `before`, of the same scene under another load, gives its
    arrays.
    """

    def __init__(
        self,
        boom: BoomPredictor,
        limits: Limits,
        state: TwinState,
        channels: Mapping[Stream, tuple[str, ...]],
        judge: HealthMonitor | None,
        counts: Counter[str],
        shedding: LoadShedding,
        capacity: int = ROOM.samples,
        before: BlockUpdate | None = None,
    ) -> None:
        self._shedding, self._boom, self.limits, self._state, self._channels = shedding, boom, limits, state, channels
        self._judge, self._told_counts = judge, counts
        self._joints, self._pins = boom.plan.joints, len(boom.plan.pins)
        drives = CODES[Stream.STROKES], limits.drive
        self._measured = [(code, int(width)) for code, width in enumerate(limits.channels) if code not in drives]
        self._capacity, sizes = capacity, (2 * capacity, self._joints, boom.width, boom.stations, limits.channels)
        self._found: UpdateOutput = new_output(*sizes) if before is None else before._found
        self._found.counts[:] = 0
        self._begin, self._told, self._news = (0, 0), (0, 0), NO_EXTRAS
        self._due: Run | None = None  # whose newest slot is still to be judged
        self._begins_health = False  # before it is told anything
        self._held: _Held | None  # what the compiled code takes with every call
        is_same = before is not None and before._state is state
        self._kept: tuple[Any, Any] | None = before._kept if before is not None and is_same else None  # state and output, held
        self._code: _Code | None = before._code if before is not None and is_same else None

    @property
    def limits(self) -> Limits:
        """Limits that the compiled update checks samples against."""
        return self._limits

    @limits.setter
    def limits(self, limits: Limits) -> None:
        self._limits, self._held = limits, None

    def begin_health(self) -> None:
        """Restart the health monitor with the next data; what was found up to now is not passed to it."""
        self._told, self._due, self._begins_health = tuple(self._found.counts.tolist()), None, True

    def advance(self, run: Run | None, block: SampleBlock, trusted: bool = False) -> tuple[int, int]:
        """Take regular samples of a block of at most `capacity`; return why that ended, see `DONE`, and how many were taken.

        `run` is the present one. `trusted`: the only sample was looked at before. `reports` or `report` return the results.
        """
        self.judge()
        self.make_room()
        row, size = 0, len(block.stamps)
        advance, arguments, found = self._held or self._hold()
        while True:
            reason, row = advance(*arguments, *block, row, trusted, found)
            if reason != LOOK:
                break
            self._look_around(run, row)
            row += 1
            if row == size:  # the judgement, if one is due, is for who asked to take
                reason = DONE
                break
            self._take_judgement(row - 1)
        self._count_unmatched()
        return reason, row

    def _count_unmatched(self) -> None:
        if unmatched := int(self._state.clock[UNMATCHED]):
            self._told_counts["unmatched"] += unmatched
            self._state.clock[UNMATCHED] = 0

    def _hold(self) -> _Held:
        """Look up the compiled code and prepare the arguments of every call; another load renews few of them."""
        self._kept = state, found = self._kept or (hold(self._state), hold(self._found))
        limits, (one, width) = hold(self._limits), (np.zeros(1, np.int64), int(self._limits.channels.max()))
        arguments = *self._boom.held, limits, state
        if self._code is None:
            self._code = update.for_types_of(*arguments, one, one, np.zeros((1, width)), 0, False, found)
        self._held = self._code, arguments, found
        return self._held

    def make_room(self) -> None:
        """Prepare the next call of the compiled update; pass pending rows to the health monitor when the buffer is full."""
        self._begin, self._news = tuple(self._found.counts.tolist()), NO_EXTRAS
        if max(self._begin) > self._capacity:
            self._tell_health()
            self._found.counts[:] = 0
            self._begin = self._told = 0, 0

    def _look_around(self, run: Run | None, row: int) -> None:
        clock, at = self._state.clock, int(self._found.counts[0]) - 1 - self._begin[0]
        if self._news is NO_EXTRAS:
            self._news = _UpdateExtras()
        news = self._news
        if clock[IS_DEFLECTED]:
            news.events[row] = ("deflected",)
            self._told_counts["deflected"] += 1
        if not clock[BEGINS_SLOT]:
            return
        if not self._shedding.leaves_out_shape():
            news.drawn[at] = self._boom.drawn
        is_doubtful = bool(clock[IS_DEFLECTED])  # what the model is not valid for accuses no sensor
        if self._judge is not None and (is_doubtful or self._shedding.leaves_out_health()):
            self._told = tuple(self._found.counts.tolist())
        elif self._judge is not None:
            self._due = run

    @property
    def is_due(self) -> bool:
        """Return True if the newest sample began a slot and the rig's health has not been judged since."""
        return self._due is not None

    def judge(self) -> Health | None:
        """Judge the rig's health if the newest sample began a slot and was not judged yet; return it or None.

        A live node publishes the report of that sample first. The judgement comes before the next sample.
        """
        run, self._due = self._due, None
        if run is None or self._judge is None:
            return None
        self._tell_health(run.newest // SLOT * SLOT)
        health = self._judge.judge(run.newest, self._boom.tip_load, lambda: self._boom.tip_sigmas)
        self._boom.leave_out(self._judge.suspected, self._judge.failing_strokes)
        return health

    def _take_judgement(self, row: int) -> None:
        if (health := self.judge()) is not None:
            self._news.health[row] = health

    def _tell_health(self, end: float = inf) -> None:
        """Pass the results since the last call to the health monitor, but those from `end` (ns) on."""
        found = self._found
        if self._judge is None:
            return
        if self._begins_health:
            self._judge.begin()
            self._begins_health = False
        counts = found.counts.tolist()
        for which, stamps in enumerate((found.stamps, found.residual_stamps)):
            while counts[which] > self._told[which] and stamps[counts[which] - 1] >= end:
                counts[which] -= 1
        (predicted, compared), self._told = self._told, (counts[0], counts[1])
        if counts[0] > predicted:
            own = slice(predicted, counts[0])
            variances = found.rows[own, self._boom.places.variances].copy()
            self._judge.predicted(PredictionRows(found.stamps[own].copy(), found.measured[own].copy(), variances))
        streams = found.residual_streams[compared : counts[1]]
        present = set(streams.tolist())
        for code, width in self._measured:
            if code in present:
                rows = compared + np.flatnonzero(streams == code)
                values = (each[rows, :width] for each in (found.raw, found.values, found.sigmas))
                self._judge.measured(STREAMS[code], MeasuredRows(found.residual_stamps[rows], *values))

    def _residuals(self) -> ResidualBlock:
        found, own = self._found, slice(self._begin[1], int(self._found.counts[1]))
        fields = found.residual_at, found.residual_streams, found.residual_stamps, found.values, found.sigmas
        return ResidualBlock._make(each[own].copy() for each in fields)

    def _predictions(self, own: slice) -> PredictionBlock:
        found, at = self._found, self._boom.places
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
            clearances=rows[:, at.pins].reshape(len(rows), self._pins, PIN),
            moments=found.moments[own].copy(),
            outlines=self._outlines(),
        )

    def _outlines(self) -> dict[int, Outline]:
        drawn = self._news.drawn
        return dict(zip(drawn, self._boom.outlines(list(drawn.values())), strict=True)) if drawn else {}

    def reports(self, stamps: NDArray[np.int64]) -> list[ReportBlock | Report]:
        """Return reports of the samples with these stamps (ns) from the results of the compiled update."""
        self._take_judgement(len(stamps) - 1)
        own = slice(self._begin[0], int(self._found.counts[0]))
        estimates = EstimateBlock(self._found.stamps[own].copy(), self._found.estimates[own].copy())
        block = ReportBlock(stamps, self._predictions(own), estimates, self._residuals(), self._news.health)
        if not self._news.events:
            return [block]
        reports = enumerate(block.reports(self._joints))
        return [replace(each, events=self._news.events.get(row, ())) for row, each in reports]

    def report(self, stamp: int, events: Sequence[str], judged: bool = True) -> Report:
        """Return the report of one sample, with `events` added; unless `judged`, health is left out, see `judge`."""
        found, news, (predicted, known) = self._found, self._news, self._found.counts.tolist()
        residuals = tuple(self._residuals_in(row) for row in range(self._begin[1], known))
        if predicted == self._begin[0]:
            return Report(stamp, True, residuals=residuals, events=tuple(events))
        at, events = predicted - 1, (*events, *news.events.get(0, ()))
        prediction = self._predictions(slice(at, predicted)).one(0)
        health = self.judge() if judged else None
        estimate = estimate_of(stamp, found.estimates[at].copy())
        return Report(stamp, True, prediction, residuals, tuple(events), health=health, estimate=estimate)

    def _residuals_in(self, row: int) -> Residuals:
        found, stream = self._found, STREAMS[int(self._found.residual_streams[row])]
        names = self._channels[stream]
        values, sigmas = (array[row, : len(names)].copy() for array in (found.values, found.sigmas))
        return Residuals(stream, int(found.residual_stamps[row]), names, values, sigmas)
