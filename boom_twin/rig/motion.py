"""Drive programmes of moves and holds: strokes and rates as functions of time."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..errors import UsageError
from ..records import Array


def ease(x: Array) -> Array:
    """Quintic from 0 to 1 over x in [0, 1] with zero rate and acceleration at both ends."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x**3 * (10.0 - 15.0 * x + 6.0 * x**2))


def ease_rate(x: Array) -> Array:
    """Derivative of `ease` by x."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(30.0 * (x * (1.0 - x)) ** 2)


@dataclass(frozen=True, slots=True)
class Move:
    """One cylinder (0-based) goes to an absolute stroke `target` (m), from `start` (s) for `duration` (s)."""

    cylinder: int
    start: float
    duration: float
    target: float

    @property
    def end(self) -> float:
        """Second at which the target is reached."""
        return self.start + self.duration


@dataclass(frozen=True)
class Programme:
    """Moves of all cylinders; between them they hold. Strokes are twice continuously differentiable.

    Parameters
    ----------
    first : tuple of float
        Strokes (m) at the start, one per cylinder.
    moves : tuple of Move
        In any order; two moves of one cylinder must not overlap.
    """

    first: tuple[float, ...]
    moves: tuple[Move, ...]

    def __post_init__(self) -> None:
        for cylinder in range(len(self.first)):
            own = self._moves_of(cylinder)
            for before, after in pairwise(own):
                if after.start < before.end:
                    raise UsageError(
                        f"moves of cylinder_{cylinder + 1}: the one at {after.start:g} s starts before the end "
                        f"of the one before it, {before.end:g} s. Start it later."
                    )

    def __call__(self, times: Array) -> tuple[Array, Array]:
        """Strokes (m) and rates (m/s), each (m, n), at `times` (m,) in s."""
        times = np.asarray(times, float)
        strokes = np.tile(np.array(self.first), (len(times), 1))
        rates = np.zeros_like(strokes)
        for cylinder, at in enumerate(self.first):
            for move in self._moves_of(cylinder):
                x = (times - move.start) / move.duration
                strokes[:, cylinder] += (move.target - at) * ease(x)
                rates[:, cylinder] += (move.target - at) / move.duration * ease_rate(x)
                at = move.target
        return strokes, rates

    def _moves_of(self, cylinder: int) -> list[Move]:
        return sorted((move for move in self.moves if move.cylinder == cylinder), key=lambda move: move.start)
