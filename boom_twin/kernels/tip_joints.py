"""Numbers of a message that follow from others: joints of the tip, and the quaternion of the estimated angle."""

import math

from .jit import inner, kernel


@kernel
def write_derived(pivot, lengths, numbers, first, at):
    """Write the joints of the tip (m, m, rad) and sine and cosine of half the angle of the estimate into rows of numbers.

    Joints begin at column `first`, those of the tip at column `at`, and the estimate behind them.
    """
    for row in numbers:
        angle, x, y = 0.0, 0.0, 0.0
        along = across = math.nan
        for i in range(lengths.shape[0]):
            angle += row[first + i]
            along, across = turn(angle)
            x, y = x + lengths[i] * along, y + lengths[i] * across
        dx, dy = row[0] - (pivot[0] + x), row[1] - (pivot[1] + y)
        row[at], row[at + 1], row[at + 2] = along * dx + across * dy, along * dy - across * dx, row[2] - angle
        row[-1], row[-2] = turn(0.5 * row[at + 5])


@inner
def turn(angle):
    """Return cosine and sine of an angle (rad); NaN of infinity."""
    return (math.cos(angle), math.sin(angle)) if math.isfinite(angle) else (math.nan, math.nan)
