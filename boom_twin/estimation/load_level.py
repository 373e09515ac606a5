"""How large the unknown load at the tip is taken to be: the level of its two components follows the sensors' innovations.

A component f_b that is a little other than the filter has it adds s_ib to the innovation i, in deviations. Of the innovations
nu of one sample, least squares tell of each component, whatever the other is, the number

    y_b = [(S^T S)^-1 S^T nu]_b / sqrt([(S^T S)^-1]_bb),

of variance 1 if the innovations are white. While successive y_b are alike, the filter is too slow and the level rises; while
they alternate it is too quick and it falls (Mehra 1970, see `boom_twin.estimation.tip_estimate`). A pump pushes upward and
wind forward: one level for both would state too much of one and too little of the other.

Angles tell what a load does at rest, an IMU what it does at once.
"""

from __future__ import annotations

import math

from ..kernels.jit import inner
from .deviation_filter import LEAST_LOAD, MOST_LOAD

AGILITY, RETREAT = 2.0, 0.01  # 1/s, by which the level follows; likeness of innovations at which it stays
ALIKE = 4.0  # most that one product of successive y counts
ALONE = 1e-9  # determinant of S^T S over the product of its diagonal, below which only one component can be told
BY_ANGLES, BY_IMU = 0, 1  # rows of `before`

XX, XY, YY, X, Y = range(5)  # places in `likely`: S^T S, and S^T nu


@inner
def begin_sample(f):
    """No innovation is known of a sample."""
    f.likely[:] = 0.0


@inner
def add_innovation(f, by_x, by_y, innovation):
    """Take one innovation, in deviations, and what 1 N of the load would add to it."""
    s = f.likely
    s[XX], s[XY], s[YY] = s[XX] + by_x * by_x, s[XY] + by_x * by_y, s[YY] + by_y * by_y
    s[X], s[Y] = s[X] + by_x * innovation, s[Y] + by_y * innovation


@inner
def follow_levels(f, sensor, h):
    """Follow the innovations of a sample that was taken h (s) after the one before."""
    s = f.likely
    both = s[XX] * s[YY]
    own = both - s[XY] * s[XY]
    if own > ALONE * both:
        follow_level(f, sensor, 0, (s[X] * s[YY] - s[Y] * s[XY]) / math.sqrt(own * s[YY]), h)
        follow_level(f, sensor, 1, (s[Y] * s[XX] - s[X] * s[XY]) / math.sqrt(own * s[XX]), h)
        return
    follow_level(f, sensor, 0, s[X] / math.sqrt(s[XX]) if s[XX] > 0.0 else 0.0, h)
    follow_level(f, sensor, 1, s[Y] / math.sqrt(s[YY]) if s[YY] > 0.0 else 0.0, h)


@inner
def follow_level(f, sensor, b, found, h):
    """Likewise of component b, of which the innovations tell the number `found`."""
    alike = min(max(found * f.before[sensor, b], -ALIKE), ALIKE)
    f.before[sensor, b] = found
    level = f.level[b] * math.exp(AGILITY * h * (alike - RETREAT))
    f.level[b] = min(max(level, f.loads[LEAST_LOAD]), f.loads[MOST_LOAD])
