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
FED, FED_STAMP, DOUBTS, IS_OLD, STARTED = range(5)  # of `status`
LOGGED = 64  # innovations of a channel that are kept: of a second of a fault twin
DELAYED = 128  # states at most that hold readings of late streams, see `delayed`


class SensorNoise(NamedTuple):
    """Variances of what drives the model, error of the scene, sizes of loads: usual, least, first in a session, just come.

    length2, zero2, rounding2 : of lengths (m^2) or angles (rad^2): of a reading, of its zero, of the rounding that stays while
    the boom is at rest. scene_error : relative standard deviation of stiffnesses and masses. The
    loads are in N.
    """

    length2: float
    zero2: float
    rounding2: float
    scene_error: float
    usual_load: float
    least_load: float
    first_load: float
    burst_load: float


@by_reference
class Filters(NamedTuple):
    """Filters of one boom.

    n cylinders, m modes at most, c measured channels, z errors of sensors, s states of the estimate, p of them of the
    prediction (zeros behind). What drives the model, below "length", is an angle (rad) where angles drive it.
    """

    x: Array  # (6, s) states of the models
    p: Array  # (6, s, s) their covariances
    chances: Array  # (6,) their probabilities, in each mixture one in all
    mean: Array  # (2, s) of the mixtures
    spread: Array  # (2, s, s) covariances of these
    load2: Array  # (2, 2) variances of the fast load, of prediction and estimate, along x and y, N^2
    jerk: Array  # (n,) density of the jerk of drives, m^2/s^5
    is_open: NDArray[np.int64]  # (2, n) 1 where a valve is believed open
    still: Array  # (2, n) time since its drive began to stand still, s
    # (5,) whether the estimate has readings of its own, stamp of the newest of these, doubts by the prediction, whether its
    # covariance in `spread` is older than its models, stamp of the first lengths
    status: NDArray[np.int64]
    masked: NDArray[np.bool_]  # (c,) channels that the estimate is not to use
    deaf: NDArray[np.bool_]  # (n,) lengths that no model is to use
    excess: Array  # (c,) variance that a channel shows over the stated one, at least 1
    ratio: Array  # (c,) mean square of normalised innovations
    drift: Array  # (z,) variance of the random walk over the usual one
    length2: Array  # (n,) variances of lengths as learnt, m^2
    before: Array  # (n, 3) the three lengths before, m
    interval: Array  # (2,) time between the newest two lengths, and that of `transition`, s
    bends: Array  # (sites, 2) accelerations of sites by their curved ways, m/s^2
    # (n + 1, 7) of pivots and tip: that acceleration (2); of the chords behind them: rate (rad/s), angular accelerations by
    # linkages and about rest (rad/s^2); acceleration that pivots and tip have by these off their places at rest (2)
    ways: Array
    swing: Array  # (m,) modal forces by the accelerations of curved ways
    inputs: Array  # (2 m,) changes of modal coordinates and rates in a step by these
    sway2: Array  # (n,) square of the largest angle by which an inclinometer lately erred, rad^2
    apart: Array  # (n,) recent mean of what angle sensors read more than the lengths make of them, rad; 0 where `settled`
    settled: NDArray[np.bool_]  # (n,) joints of which the length or the angle is known to be wrong
    lags: Array  # (streams,) time by which stamps are late, as estimated, s
    late: Array  # (streams,) time by which samples arrived after their stamps, at most, s
    taken: NDArray[np.int64]  # (streams,) stamps of the newest samples that corrected the estimate, ns
    curves: Array  # (c, 3) expected readings, their rates, and mean squares of their second derivatives
    copies: NDArray[np.int64]  # (c,) places of late channels among the copies of one instant, -1 of others
    instants: NDArray[np.int64]  # (DELAYED,) stamps of copies, see `delayed`
    noise: SensorNoise
    modal: Array  # (m, 6) part of the modes in the transition matrix
    transition: Array  # (p, p) its transpose
    variances: Array  # (s,) of its noise
    felt: Array  # (c,) specific force that channels of accelerometers read by `motion`, m/s^2
    fault: Array  # (6,) variances of the tip by named faults, see `named_faults`
    lateness: Array  # (1,) named lag of what drives the model, s
    pulls: Array  # (n,) predicted forces, N
    evidence: Array  # (1,) logarithm of the likelihood of all that was read, up to a constant
    driving: Array  # (n, s) rows of the lengths
    offsets: Array  # (n,) lengths at a state of zeros
    shaking: Array  # (sites, 2) mean squares of acceleration, m^2/s^4, and of rate of turn, rad^2/s^2
    motion: Array  # (sites, 9) predicted x, y, angle (m, rad), their rates, their accelerations
    strokes: Array  # (n, 3) predicted lengths (m), their rates and accelerations
    innovations: Array  # (n, 2) newest lengths less what the prediction's mixture expected before them (m); their variances
    log: Array  # (n + c, LOGGED, 2) innovations and their variances since the last `BoomPredictor.take_innovations`
    logged: NDArray[np.int64]  # (n + c,) how many of each channel
    # scratch
    turned: Array
    kept: Array
    kept_mean: Array
    row: Array
    gain: Array
    gains: Array
    rows: Array
    likely: Array
    switch: Array
    shares: Array


class Innovations(NamedTuple):
    """Innovations of each channel, those that drive the model first, and their variances, as the filter expected them.

    values, variances : (n + c, k). counts : (n + c,) how many of each row there are.
    """

    values: Array
    variances: Array
    counts: NDArray[np.int64]


def new_filters(joints: int, modes: int, measured: Measurement, noise: SensorNoise) -> Filters:
    """Return filters of a boom with so many joints, modes at most, and these measured channels."""
    n, channels, sites, behind = joints, len(measured.channels), len(measured.sites), 4 + 2 * joints + len(measured.errors)
    own = 2 * modes + LOADS + 3 * joints
    states = whole(own + behind + DELAYED)
    return Filters(
        x=np.zeros((6, states)), p=vectors(6, states, states), chances=np.zeros(6), mean=np.zeros((2, states)),
        spread=vectors(2, states, states), load2=np.zeros((2, 2)), jerk=np.zeros(n), is_open=np.zeros((2, n), np.int64),
        still=np.zeros((2, n)), status=np.zeros(5, np.int64), masked=np.zeros(channels, np.bool_),
        deaf=np.zeros(n, np.bool_), excess=np.ones(channels), ratio=np.ones(channels), drift=np.ones(behind),
        length2=np.full(n, noise.length2), before=np.full((n, 3), np.nan), interval=np.zeros(2), bends=np.zeros((sites, 2)),
        ways=np.zeros((n + 1, 7)), swing=np.zeros(modes), inputs=np.zeros(2 * modes),
        sway2=np.zeros(n), apart=np.zeros(n), settled=np.zeros(n, np.bool_), lags=np.zeros(len(Stream)), noise=noise,
        late=np.zeros(len(Stream)), taken=np.zeros(len(Stream), np.int64), curves=np.zeros((channels, 3)),
        copies=np.full(channels, -1), instants=np.zeros(DELAYED, np.int64),
        modal=np.zeros((modes, 6)), transition=vectors(own, whole(own)), turned=vectors(own, whole(own)),
        kept=np.zeros((states, states)), kept_mean=np.zeros(states),
        variances=np.zeros(states), felt=np.zeros(channels), fault=np.zeros(6), lateness=np.zeros(1),
        pulls=np.zeros(n), evidence=np.zeros(1),
        row=vectors(states), gain=vectors(states), gains=vectors(4, 4, states), driving=vectors(n, states), offsets=np.zeros(n),
        rows=vectors(9, states), likely=np.zeros(6),
        switch=np.zeros((3, 3)), shares=np.zeros((3, 3)), shaking=np.zeros((sites, 2)), motion=np.zeros((sites, 9)),
        strokes=np.zeros((n, 3)), innovations=np.zeros((n, 2)), log=np.zeros((n + channels, LOGGED, 2)),
        logged=np.zeros(n + channels, np.int64),
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

    Zeros (2), mount, scale of the tip IMU, zeros of angles and forces follow, then uncertain zeros of strokes, and
    the errors of further sensors.
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
