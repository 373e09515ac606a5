"""Record the steps that a boom takes, and repeat them in another twin of it, in place of solving its equations again.

Nearly half of what a twin does is to step its boom, which depends on the strokes alone and on nothing that is made of a step
afterwards: expected readings, residuals, estimate, health. So a replay steps the boom in one thread and does the rest in
another. Both take the same strokes and come to the same steps in the same order; what a step leaves is written as so many
numbers, bit for bit, and with it the time and the strokes that it was taken for, which are compared when it is repeated.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.integrators import X
from ..kernels.jit import by_reference, hold, inner, kernel
from ..types import Array
from .stroke_filter import forget_integrals, integrate

STEPPING, RECORDING, REPEATING = range(3)
"""What is done with steps: nothing beside taking them; they are written down too; they are repeated."""
MODE, PLACE, END = range(3)  # of `StepRows.state`
STATUS, TIME, SPAN, PASSES, PACE, BEGAN = range(6)  # of a step's first numbers
HEAD = 6
OTHER = -1  # status of a step that was recorded for other strokes, or was not recorded


@by_reference
class StepRows(NamedTuple):
    """Recorded steps, one after the other.

    state : (3,) what is done with steps, see `STEPPING`; where the next one begins; where the last one ends.
    numbers : (k,) of the steps.
    """

    state: NDArray[np.int64]
    numbers: Array


class RecordedSteps:
    """What one twin hands to another, see the module; a twin that is told nothing steps its boom and keeps none of it."""

    def __init__(self) -> None:
        self.rows = StepRows(np.array([STEPPING, 0, 0]), np.zeros(0))
        self.held: Any = hold(self.rows)

    @property
    def are_recorded(self) -> bool:
        """Whether steps are written down, and nothing is made of them."""
        return bool(self.rows.state[MODE] == RECORDING)

    def record(self) -> None:
        """Write down all steps from now on."""
        self.rows.state[MODE] = RECORDING

    def taken(self) -> Array:
        """The steps since this was called last; a view, until the next step."""
        end, self.rows.state[PLACE] = int(self.rows.state[PLACE]), 0
        return self.rows.numbers[:end]

    def repeat(self, steps: Array) -> None:
        """Repeat these, which `taken` gave of another twin, when those before are used up.

        Raises
        ------
        RuntimeError
            There are some left: the other twin came to steps that this one did not come to.
        """
        state = self.rows.state
        if state[MODE] == REPEATING and state[PLACE] != state[END]:
            raise RuntimeError(f"{state[END] - state[PLACE]} numbers of recorded steps were not repeated")
        self._put(StepRows(np.array([REPEATING, 0, len(steps)]), steps))

    def make_room(self, steps: int, width: int) -> None:
        """Let so many more steps be recorded, each of at most so many numbers."""
        numbers, used = self.rows.numbers, int(self.rows.state[PLACE])
        if len(numbers) < used + steps * width:
            more = np.zeros(max(2 * len(numbers), used + steps * width))
            more[:used] = numbers[:used]
            self._put(StepRows(self.rows.state, more))

    def _put(self, rows: StepRows) -> None:
        self.rows, self.held = rows, hold(rows)


def step_width(live: Any, work: Any, track: Any, out: Array) -> int:
    """Most numbers that a step of a boom leaves, see `boom_twin.estimation.look_ahead.follow`."""
    bank, strokes = track.bank, len(track.drive)
    of_filter = bank.nodes[0].size + bank.covariance.size + bank.weights.size + bank.excess.size + bank.is_lost.size
    state = sum(each.size for each in live)
    return int(HEAD + strokes + of_filter + state + work.position.size + track.angles.size + out.size)


@kernel
def record_step(steps, live, work, track, time, strokes, is_drawn, status, out):
    """Write down what a step has left, which was taken for strokes (m) at a time (s); see `look_ahead.follow`.

    is_drawn : whether an outline may be made of it.
    """
    first = steps.state[PLACE]
    numbers, lost = steps.numbers[first:], track.bank.is_lost
    numbers[STATUS], numbers[TIME], numbers[PASSES], numbers[PACE] = status, time, track.passes[0], live.pace[0]
    numbers[SPAN] = time - track.times[1] if track.nodes[0] > 1 else math.nan
    numbers[BEGAN] = track.bank.began[0]
    at = copy(numbers, HEAD, strokes, False)
    for i in range(lost.shape[0]):
        numbers[at + i] = lost[i]
    steps.state[PLACE] = first + copy_left(numbers, at + lost.shape[0], live, work, track, out, is_drawn, False)


@kernel
def repeat_step(steps, live, work, track, time, strokes, is_drawn, out):
    """Leave what the next recorded step left; gives its status, or `OTHER` if it was not for these strokes at this time."""
    first, lost = steps.state[PLACE], track.bank.is_lost
    numbers = steps.numbers[first : steps.state[END]]
    if numbers.shape[0] == 0 or numbers[TIME] != time:
        return OTHER
    for i in range(strokes.shape[0]):
        then = numbers[HEAD + i]
        if strokes[i] != then and (math.isfinite(strokes[i]) or math.isfinite(then)):
            return OTHER
    track.passes[0], live.pace[0], track.bank.began[0] = int(numbers[PASSES]), int(numbers[PACE]), int(numbers[BEGAN])
    at = HEAD + strokes.shape[0]
    for i in range(lost.shape[0]):
        lost[i] = int(numbers[at + i])
    steps.state[PLACE] = first + copy_left(numbers, at + lost.shape[0], live, work, track, out, is_drawn, True)
    if math.isfinite(numbers[SPAN]):
        integrate(track.bank, numbers[SPAN])
    else:
        forget_integrals(track.bank)
    return int(numbers[STATUS])


@inner
def copy_left(numbers, at, live, work, track, out, is_drawn, is_read):
    """What a step leaves but for whole numbers; gives where it ends. Of histories, a step's other rows are of the next step."""
    bank = track.bank
    at = copy(numbers, at, live.z, is_read)
    at = copy(numbers, at, live.history[X], is_read)
    at = copy(numbers, at, live.frames, is_read)
    at = copy(numbers, at, live.turns, is_read)
    at = copy(numbers, at, live.pins, is_read)
    at = copy(numbers, at, live.contacts, is_read)
    at = copy(numbers, at, live.drives, is_read)
    at = copy(numbers, at, track.angles, is_read)
    at = copy(numbers, at, bank.nodes[0], is_read)
    at = copy(numbers, at, bank.covariance, is_read)
    at = copy(numbers, at, bank.weights, is_read)
    at = copy(numbers, at, bank.excess, is_read)
    at = copy(numbers, at, out, is_read)
    return copy(numbers, at, work.position, is_read) if is_drawn else at


@inner
def copy(numbers, at, field, is_read):
    """A field to `numbers` from a place on, or from there; gives where it ends."""
    flat = field.reshape(field.size)
    for i in range(flat.shape[0]):
        if is_read:
            flat[i] = numbers[at + i]
        else:
            numbers[at + i] = flat[i]
    return at + flat.shape[0]
