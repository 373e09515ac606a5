"""States of the filters of one boom: their places, and all that the filters remember."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.jit import by_reference, inner
from ..types import Array, Stream

if TYPE_CHECKING:
    from .channels import Measurement

VALVES, OPEN, BURST = range(3)  # models of the prediction
ALL_VALVES, ALL_OPEN, ALL_BURST = range(3, 6)  # models of the estimate
PREDICTION, ESTIMATE = range(2)  # mixtures of these
LOADS = 6  # states of the load at the tip: along x and y its fast part (2), its slow part (2), rates of the fast part (2)
FED, FED_STAMP, DOUBTS, IS_OLD = range(4)  # of `status`
DELAYED = 128  # states at most that hold readings of late streams, see `delayed`


class SensorNoise(NamedTuple):
    """Variance of what drives the model, error of the scene, sizes of loads: usual, least, first in a session, just come.

    length2 : of lengths (m^2) or angles (rad^2). scene_error : relative standard deviation of stiffnesses and masses. The
    loads are in N.
    """

    length2: float
    scene_error: float
    usual_load: float
    least_load: float
    first_load: float
    burst_load: float


@by_reference
class Filters(NamedTuple):
    """Filters of one boom; n cylinders, m modes at most, s states, p of them of the prediction (zeros behind).

    x, p : (6, s), (6, s, s) states and covariances of the models. chances : (6,) of them, in each mixture one in all.
    mean, spread : (2, s), (2, s, s) of the mixtures. load2 : (2, 2) variances of the fast load, N^2, of prediction and
    estimate, along x and y.
    jerk : (n,) m^2/s^5. is_open, still : (2, n) 1 where a valve is believed open, s since its drive began to stand still.
    status : (4,) whether the estimate has readings of its own, stamp of the newest of these, doubts by the prediction, whether
    its covariance in `spread` is older than its models.
    masked, deaf : (c,), (n,) measured channels that the estimate, and strokes that no model is to use. noise : variances.
    excess : (c,) times the variance that channels are stated to have. ratio : (c,) mean square of their normalised innovations.
    drift : (z,) times the usual variance of the random walk of sensors' zeros. length2 : (n,) variances of lengths as learnt,
    m^2. before, interval : (n, 3), (2,) the three lengths before (m); times between the newest two, and of `weights`, s.
    apart : (n,) recent mean of what angle sensors read more than the lengths make of them, rad; 0 where `settled`, the (n,)
    joints of which the stroke or the angle is known to be wrong.
    lags, late : (streams,) by which stamps are late, as estimated, and by which samples arrived after their stamps at most, s.
    copies : (c,) places of late channels among the copies of one instant, -1 of others. instants : (DELAYED,) stamps of copies,
    see `delayed`. taken : (streams,) stamps of the newest samples that corrected the estimate, ns. curves : (c, 3) expected
    readings, their rates, and mean squares of their second derivatives.
    bends : (sites, 2) accelerations that sites have by their curved ways, m/s^2. ways : (n + 1, 7) those of pivots and tip (2),
    rates (rad/s), angular accelerations by linkages, and about rest (rad/s^2) of the chords behind them, accelerations that
    pivots and tip have by these off their places at rest (2). swing : (m,) modal forces by these. inputs : (2 m,) changes of
    modal coordinates and rates in a step by them. sway2 : (n,) square of the largest angle by which an inclinometer lately
    erred, rad^2.
    modal, transition : (m, 6), (p, p) part of the modes in the transition matrix, and its transpose. variances : (s,) of its
    noise.
    motion : (sites, 9) predicted x, y, angle of every site, m and rad, their rates, their accelerations.
    shaking : (sites, 2) mean squares of its acceleration, m^2/s^4, and of its rate of turn, rad^2/s^2. felt : (c,) specific
    force that channels of accelerometers read by that, m/s^2.
    strokes : (n, 3) predicted lengths (m), their rates and accelerations.
    innovations : (n, 2) newest lengths less what the prediction's mixture expected before them (m), and their variances.
    Where angles drive the model, length2, before, strokes and innovations are of angles, in rad.
    driving, offsets : (n, s), (n,) rows of what drives the model, and its readings at a state of zeros.
    pulls : (n,) predicted forces, N. evidence : (1,) logarithm of the likelihood of all that was read, up to a constant.
    The others are scratch.
    """

    x: Array
    p: Array
    chances: Array
    mean: Array
    spread: Array
    load2: Array
    jerk: Array
    is_open: NDArray[np.int64]
    still: Array
    status: NDArray[np.int64]
    masked: NDArray[np.bool_]
    deaf: NDArray[np.bool_]
    excess: Array
    ratio: Array
    drift: Array
    length2: Array
    before: Array
    interval: Array
    bends: Array
    ways: Array
    swing: Array
    inputs: Array
    sway2: Array
    apart: Array
    settled: NDArray[np.bool_]
    lags: Array
    late: Array
    taken: NDArray[np.int64]
    curves: Array
    copies: NDArray[np.int64]
    instants: NDArray[np.int64]
    noise: SensorNoise
    modal: Array
    transition: Array
    variances: Array
    felt: Array
    pulls: Array
    evidence: Array
    turned: Array
    kept: Array
    kept_mean: Array
    row: Array
    gain: Array
    gains: Array
    driving: Array
    offsets: Array
    rows: Array
    likely: Array
    switch: Array
    shares: Array
    shaking: Array
    motion: Array
    strokes: Array
    innovations: Array


def new_filters(joints: int, modes: int, measured: Measurement, noise: SensorNoise) -> Filters:
    """Return filters of a boom with so many joints, modes at most, and these measured channels."""
    n, channels, sites, behind = joints, len(measured.channels), len(measured.sites), 4 + 2 * joints + len(measured.errors)
    own = 2 * modes + LOADS + 3 * joints
    states = whole(own + behind + DELAYED)
    return Filters(
        x=np.zeros((6, states)), p=vectors(6, states, states), chances=np.zeros(6), mean=np.zeros((2, states)),
        spread=vectors(2, states, states), load2=np.zeros((2, 2)), jerk=np.zeros(n), is_open=np.zeros((2, n), np.int64),
        still=np.zeros((2, n)), status=np.zeros(4, np.int64), masked=np.zeros(channels, np.bool_),
        deaf=np.zeros(n, np.bool_), excess=np.ones(channels), ratio=np.ones(channels), drift=np.ones(behind),
        length2=np.full(n, noise.length2), before=np.full((n, 3), np.nan), interval=np.zeros(2), bends=np.zeros((sites, 2)),
        ways=np.zeros((n + 1, 7)), swing=np.zeros(modes), inputs=np.zeros(2 * modes),
        sway2=np.zeros(n), apart=np.zeros(n), settled=np.zeros(n, np.bool_), lags=np.zeros(len(Stream)), noise=noise,
        late=np.zeros(len(Stream)), taken=np.zeros(len(Stream), np.int64), curves=np.zeros((channels, 3)),
        copies=np.full(channels, -1), instants=np.zeros(DELAYED, np.int64),
        modal=np.zeros((modes, 6)), transition=vectors(own, whole(own)), turned=vectors(own, whole(own)),
        kept=np.zeros((states, states)), kept_mean=np.zeros(states),
        variances=np.zeros(states), felt=np.zeros(channels), pulls=np.zeros(n), evidence=np.zeros(1),
        row=vectors(states), gain=vectors(states), gains=vectors(4, 4, states), driving=vectors(n, states), offsets=np.zeros(n),
        rows=vectors(9, states), likely=np.zeros(6),
        switch=np.zeros((3, 3)), shares=np.zeros((3, 3)), shaking=np.zeros((sites, 2)), motion=np.zeros((sites, 9)),
        strokes=np.zeros((n, 3)), innovations=np.zeros((n, 2)),
    )  # fmt: skip


def vectors(*shape: int) -> Array:
    """Return zeros at an address from which the processor loads whole vectors fastest; so do rows of a `whole` length."""
    count = math.prod(shape)
    room = np.zeros(count + 8)
    first = -room.ctypes.data // 8 % 8
    return room[first : first + count].reshape(shape)


@inner
def force_place(p):
    """Return the first place of the load's states, see `LOADS`; coordinates and rates of the modes stand before."""
    return 2 * p.modes[0]


@inner
def drive_place(p):
    """Return the first place of the drives (n); their rates (n) and accelerations (n) follow."""
    return 2 * p.modes[0] + LOADS


@inner
def zero_place(p):
    """Return how many states the prediction has.

    Zeros (2), mount, scale of the tip IMU, zeros of angles and forces follow, then the errors of further sensors.
    """
    return 2 * p.modes[0] + LOADS + 3 * p.drives.shape[0]


@inner
def copy_place(p):
    """Return the first place of the copies of late readings; errors of sensors stand before from their first reading on."""
    return zero_place(p) + p.behind[0]


@inner
def all_states(p):
    """Return the number of states of the estimate."""
    return copy_place(p) + p.delayed[0]


@inner
def whole(size):
    """Return `size` rounded up to whole vectors of the processor; numbers behind `size` in a row are of no account."""
    return (size + 7) & -8
