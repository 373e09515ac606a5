"""Driver of the compiled update: calls it with blocks of samples, and makes reports of its rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import inf

import numpy as np

from ..deviation.predictor import BoomPredictor, Drawn
from ..health.monitor import HealthMonitor
from ..kernels.result_row import PIN
from ..predictions import Outline
from ..types import Health, Integers, Report, Residuals, Stream
from .blocks import (
    CODES,
    REGULAR,
    STREAMS,
    EstimateBlock,
    Note,
    PredictionBlock,
    ReportBlock,
    ResidualBlock,
    SampleBlock,
    estimate_of,
)
from .run import Run
from .state import BEGINS_SLOT, IS_DEFLECTED, ROOM, SLOT, UNMATCHED, Limits, TwinState, UpdateOutput, new_output
from .update import DONE, LOOK, update


class BlockUpdate:
    """Driver of the compiled update for regular samples.

    `channels`: see `boom_twin.types.channels_of`. The events ``deflected`` and ``unmatched`` are added to `counts`. One call
    takes at most `capacity` samples. Without `is_reporting`, reports are empty.
    """

    def __init__(
        self,
        boom: BoomPredictor,
        limits: Limits,
        state: TwinState,
        channels: Mapping[Stream, tuple[str, ...]],
        judge: HealthMonitor | None,
        counts: Counter[str],
        capacity: int = ROOM.samples,
        is_reporting: bool = True,
    ) -> None:
        self._boom, self.limits, self._state, self._channels = boom, limits, state, channels
        self._judge, self._event_counts = judge, counts
        self._joints, self._pins = boom.plan.joints, len(boom.plan.pins)
        drives = CODES[Stream.STROKES], limits.drive
        self._measured = [code for code in range(len(limits.channels)) if code not in drives]
        self._capacity, sizes = capacity, (2 * capacity, self._joints, boom.width, boom.stations, limits.channels)
        self._found: UpdateOutput = new_output(*sizes)
        self._begin, self._passed = (0, 0), (0, 0)
        self._drawn: dict[int, Drawn] = {}  # by row of a prediction
        self._health: dict[int, Health] = {}  # by row of a sample, as events
        self._events: dict[int, tuple[str, ...]] = {}
        self._due: Run | None = None  # run whose newest slot is still to be judged
        self._begins_health = False  # the health monitor restarts before the next rows are passed to it
        self._nothing = None if is_reporting else self.no_rows(0, REGULAR)

    def begin_health(self) -> None:
        """Restart the health monitor with the next rows; present rows are not passed to it."""
        self._passed, self._due, self._begins_health = tuple(self._found.counts.tolist()), None, True

    def advance(self, run: Run | None, block: SampleBlock, trusted: bool = False) -> tuple[int, int]:
        """Take regular samples of a block of at most `capacity`; return the reason for the end, see `DONE`, and their number.

        `run` is the present one. `trusted`: the block has one sample, which `SampleTaker` has checked.
        `rows` or `report` return the results.
        """
        self.judge()
        self.make_room()
        row, size = 0, len(block.stamps)
        given = *self._boom.compiled, self.limits, self._state
        while True:
            reason, row = update(*given, *block, row, trusted, self._found)
            if reason != LOOK:
                break
            self._note_slot(run, row)
            row += 1
            if row == size:  # last sample: the caller decides when health is judged
                reason = DONE
                break
            self._take_judgement(row - 1)
        self._count_unmatched()
        return reason, row

    def _count_unmatched(self) -> None:
        if unmatched := int(self._state.clock[UNMATCHED]):
            self._event_counts["unmatched"] += unmatched
            self._state.clock[UNMATCHED] = 0

    def make_room(self) -> None:
        """Prepare the next call of the compiled update; pass pending rows to the health monitor when the buffer is full."""
        self._begin = tuple(self._found.counts.tolist())
        self._drawn, self._health, self._events = {}, {}, {}
        if max(self._begin) > self._capacity:
            self._pass_to_health()
            self._found.counts[:] = 0
            self._begin = self._passed = 0, 0

    def _note_slot(self, run: Run | None, row: int) -> None:
        clock, at = self._state.clock, int(self._found.counts[0]) - 1 - self._begin[0]
        if clock[IS_DEFLECTED]:
            self._events[row] = ("deflected",)
            self._event_counts["deflected"] += 1
        if not clock[BEGINS_SLOT]:
            return
        if self._nothing is None:
            self._drawn[at] = self._boom.drawn
        if self._judge is None:
            return
        if clock[IS_DEFLECTED]:  # outside the model's validity, residuals are no faults of sensors
            self._passed = tuple(self._found.counts.tolist())
        else:
            self._due = run

    @property
    def is_due(self) -> bool:
        """Return True if the newest sample was the first of a slot of `SLOT` and health was not judged since."""
        return self._due is not None

    def judge(self) -> Health | None:
        """Judge the rig's health if the newest sample began a slot and was not judged yet; return it or None.

        A live node publishes the report of that sample first. The judgement comes before the next sample.
        """
        run, self._due = self._due, None
        if run is None or self._judge is None:
            return None
        self._pass_to_health(run.newest // SLOT * SLOT)
        health = self._judge.judge(run.newest, self._boom.tip_loads, lambda: self._boom.tip_sigmas)
        self._boom.leave_out(self._judge.suspected, self._judge.failing_strokes, self._judge.wrong_angles)
        self._boom.allow_for(self._judge.faulty_booms, self._judge.drive_lag)
        return health

    def _take_judgement(self, row: int) -> None:
        if (health := self.judge()) is not None:
            self._health[row] = health

    def _pass_to_health(self, end: float = inf) -> None:
        """Pass the rows since the last call, with stamps before `end` (ns), to the health monitor."""
        found = self._found
        if self._judge is None:
            return
        if self._begins_health:
            self._judge.begin()
            self._begins_health = False
        counts = found.counts.tolist()
        for which, stamps in enumerate((found.stamps, found.residual_stamps)):
            while counts[which] > self._passed[which] and stamps[counts[which] - 1] >= end:
                counts[which] -= 1
        (predicted, compared), self._passed = self._passed, (counts[0], counts[1])
        if counts[0] > predicted:
            own = slice(predicted, counts[0])
            read, sigmas = found.measured[own], np.sqrt(found.rows[own, self._boom.places.variances])
            self._judge.collect(STREAMS[self.limits.drive], np.arange(len(read)), found.stamps[own], read, read, sigmas)
        streams = found.residual_streams[compared : counts[1]]
        present = set(streams.tolist())
        for code in self._measured:
            if code in present:
                rows = compared + np.flatnonzero(streams == code)
                self._judge.collect(STREAMS[code], rows, found.residual_stamps, found.raw, found.values, found.sigmas)

    def _predictions(self, own: slice, outlines: dict[int, Outline]) -> PredictionBlock:
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
            outlines=outlines,
        )

    def _block(self, stamps: Integers, predicted: slice, compared: slice, outlines: dict[int, Outline]) -> ReportBlock:
        """Return the reports of samples with these stamps (ns) from rows of the results."""
        found, predictions = self._found, self._predictions(predicted, outlines)
        columns = found.residual_at, found.residual_streams, found.residual_stamps, found.values, found.sigmas
        residuals = ResidualBlock._make(each[compared].copy() for each in columns)
        estimates = EstimateBlock(predictions.stamps, found.estimates[predicted].copy())
        return ReportBlock(stamps, predictions, estimates, residuals, self._health, {})

    def _outlines(self) -> dict[int, Outline]:
        drawn = self._drawn
        return dict(zip(drawn, self._boom.outlines(list(drawn.values())), strict=True)) if drawn else {}

    def rows(self, stamps: Integers, events: Sequence[str] = (), judged: bool = True) -> ReportBlock:
        """Return the reports of the samples taken since `make_room`, with these stamps (ns); `events` are of the first.

        Unless `judged`, the health that is due with the last sample is left out, see `judge`.
        """
        if self._nothing is not None:
            return self._nothing
        if judged:
            self._take_judgement(len(stamps) - 1)
        predicted, compared = self._found.counts.tolist()
        block = self._block(stamps, slice(self._begin[0], predicted), slice(self._begin[1], compared), self._outlines())
        told = {0: tuple(events)} if events else {}
        notes = {row: Note(events=told.get(row, ()) + self._events.get(row, ())) for row in sorted(told | self._events)}
        return block._replace(notes=notes)

    def no_rows(self, stamp: int, note: Note) -> ReportBlock:
        """Return the report of a sample that gave no numbers."""
        none = slice(0, 0)
        return self._block(np.array([stamp]), none, none, {})._replace(health={}, notes={0: note})

    def report(self, stamp: int, judged: bool = True) -> Report:
        """Return the report of a regular sample, as `rows` does."""
        found, (predicted, known) = self._found, self._found.counts.tolist()
        residuals = tuple(self._residuals_in(row) for row in range(self._begin[1], known))
        if predicted == self._begin[0]:
            return Report(stamp, True, residuals=residuals)
        at, events = predicted - 1, self._events.get(0, ())
        prediction = self._predictions(slice(at, predicted), self._outlines()).one(0)
        health = self.judge() if judged else None
        estimate = estimate_of(stamp, found.estimates[at].copy())
        return Report(stamp, True, prediction, residuals, events, health=health, estimate=estimate)

    def _residuals_in(self, row: int) -> Residuals:
        found, stream = self._found, STREAMS[int(self._found.residual_streams[row])]
        names = self._channels[stream]
        values, sigmas = (array[row, : len(names)].copy() for array in (found.values, found.sigmas))
        return Residuals(stream, int(found.residual_stamps[row]), names, values, sigmas)
