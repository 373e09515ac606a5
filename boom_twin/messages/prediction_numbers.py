"""Numbers of a prediction and of its estimate in messages: their names, and the kernels that write them.

Every one of them stands once in a row of numbers, by the names of `number_names`, in the axes of the model. A message takes
some of them, with a sign: see `boom_twin.messages.numeric_outputs`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..deviation.estimate_row import FORCE_VARIANCE, MODES
from ..kernels.jit import by_reference, inner, kernel
from ..kernels.result_row import estimates_in, results_in
from ..twin.blocks import ESTIMATED, EstimateBlock, PredictionBlock
from ..types import SECOND, Array, Estimate, Prediction

TIP_NUMBERS = (
    "tip_x", "tip_y", "tip_angle",
    "velocity_x", "velocity_y", "angular_velocity",
    "acceleration_x", "acceleration_y", "angular_acceleration",
    "displacement_x", "displacement_y",
)  # fmt: skip
TIP_JOINTS = ("tip_dx", "tip_dz", "tip_pitch")
"""Displacement of the tip from that of rigid sections: along and across the last section, m, and its rotation, rad."""
COVARIANCE = "variance_xx", "covariance_xy", "covariance_xa", "variance_yy", "covariance_ya", "variance_aa"
"""Upper triangle of a covariance by rows, of x, y and angle."""
ESTIMATED_NUMBERS = (
    "estimate_x", "estimate_y", "estimate_angle",
    "estimate_velocity_x", "estimate_velocity_y", "estimate_angular_velocity",
    "estimate_acceleration_x", "estimate_acceleration_y", "estimate_angular_acceleration",
    "load_x", "load_y",
    *(f"{kind}_{j}" for kind in ("mode", "mode_rate") for j in range(1, MODES + 1)),
    *(f"{kind}{entry}" for kind in ("", "velocity_", "acceleration_") for entry in COVARIANCE),
)  # fmt: skip
"""Numbers of an estimate's row, see `boom_twin.deviation.estimate_row.WIDTH`, up to its variances of the load."""
TURN = ("sine_of_half", "cosine_of_half")
"""Sine and cosine of half the angle of the estimate, for a quaternion."""

DISPLACEMENT = TIP_NUMBERS.index("displacement_x")
JOINTS = len(TIP_NUMBERS)  # behind the joints' angles: strokes, cylinders' forces, the tip's joints, the estimate
SECONDS, NANOSECONDS = range(2)  # of a stamp in a message


def number_names(joints: int) -> tuple[str, ...]:
    """Return the names of the numbers (SI units) for a boom with `joints` joints, in the order of a row."""
    own = [f"{kind}_{i}" for kind in ("joint", "stroke", "force") for i in range(1, joints + 1)]
    return *TIP_NUMBERS, *own, *TIP_JOINTS, *ESTIMATED_NUMBERS, *TURN


class Chain(NamedTuple):
    """Geometry of the boom: pivot of its first joint, shape (2,), m, and lengths of its sections, shape (n,), m."""

    pivot: Array
    lengths: Array


@by_reference
class Layout(NamedTuple):
    """Layout of messages that are written together, one after the other, and the places of numbers in them.

    numbers : scratch, a row of numbers. turns : scratch, shape (n + 1, 3). chosen, signs : index in the row and sign of every
    written number. doubles, words : bytes of all messages, as numbers of eight and of four bytes. places : index of every
    written number in `doubles`. stamps : index of every stamp in `words`.
    """

    numbers: Array
    turns: Array
    chosen: np.ndarray
    signs: Array
    places: np.ndarray
    stamps: np.ndarray
    doubles: Array
    words: np.ndarray


# What follows from other numbers is written by the two functions below: compiled for one row (all,), and run as they stand for
# many, a column each (all, k), because the writer of a replay does without a compiler. Sine and cosine are those of the C
# library in both, for the same bits; NumPy has its own on some processors.


@inner
def write_turns(numbers, turns):
    """Write the angle (rad) of every section, then half the estimate's, into `turns`, shape (n + 1, 3, ..)."""
    n = turns.shape[0] - 1
    turns[0, 0] = numbers[JOINTS]
    for i in range(1, n):
        turns[i, 0] = turns[i - 1, 0] + numbers[JOINTS + i]
    turns[n, 0] = 0.5 * numbers[JOINTS + 3 * n + 5]


@inner
def derive(pivot, lengths, turns, numbers):
    """Write the tip's joints, and sine and cosine of half the estimate's angle. `turns` has angle, cosine and sine."""
    n = turns.shape[0] - 1
    x, y = lengths[0] * turns[0, 1], lengths[0] * turns[0, 2]
    for i in range(1, n):
        x, y = x + lengths[i] * turns[i, 1], y + lengths[i] * turns[i, 2]
    x, y = numbers[0] - (pivot[0] + x), numbers[1] - (pivot[1] + y)
    along, across, at = turns[n - 1, 1], turns[n - 1, 2], JOINTS + 3 * n
    numbers[at] = along * x + across * y
    numbers[at + 1] = along * y - across * x
    numbers[at + 2] = numbers[2] - turns[n - 1, 0]
    numbers[at + 3 + FORCE_VARIANCE], numbers[at + 4 + FORCE_VARIANCE] = turns[n, 2], turns[n, 1]


def number_columns(
    chain: Chain, p: Prediction | PredictionBlock | None, e: Estimate | EstimateBlock | None, count: int
) -> Array:
    """Return the numbers of `count` predictions and their estimates, a column for each, shape (all, count); NaN if missing."""
    joints = len(chain.lengths)
    numbers = np.full((len(number_names(joints)), count), math.nan)
    if p is not None:
        own = p.tip_position.T, p.tip_angle, p.tip_velocity.T, p.tip_angular_velocity
        more = p.tip_acceleration.T, p.tip_angular_acceleration, p.tip_displacement.T
        _stack(numbers, (*own, *more, p.joints.T, p.strokes.T, p.cylinder_forces.T))
    if e is not None:
        parts = [getattr(e, name).T for name, place in ESTIMATED.items() if place.stop <= FORCE_VARIANCE]
        _stack(numbers[JOINTS + 3 * joints + len(TIP_JOINTS) :], parts)
    _derive_columns(chain, numbers)
    return numbers


def _stack(numbers: Array, parts: Sequence[Array | float]) -> None:
    """Write parts one below the other. A part has one or more rows, with a number for every column."""
    at = 0
    for part in parts:
        rows = np.reshape(part, (-1, numbers.shape[1]))
        numbers[at : at + len(rows)] = rows
        at += len(rows)


def _derive_columns(chain: Chain, numbers: Array) -> None:
    """Write the numbers that follow from others, for columns of numbers, shape (all, k)."""
    turns = np.zeros((len(chain.lengths) + 1, 3, numbers.shape[1]))
    write_turns(numbers, turns)
    angles = turns[:, 0].ravel().tolist()
    for k, function in ((1, math.cos), (2, math.sin)):
        turns[:, k] = np.array([function(each) if math.isfinite(each) else math.nan for each in angles]).reshape(
            turns[:, 0].shape
        )
    derive(*chain, turns, numbers)
    for row in _derived(len(chain.lengths)):
        numbers[row, np.isnan(numbers[row])] = math.nan


def _derived(joints: int) -> tuple[int, ...]:
    first = JOINTS + 3 * joints
    return first, first + 1, first + 2, first + 3 + FORCE_VARIANCE, first + 4 + FORCE_VARIANCE


@inner
def one_nan(numbers, place):
    """Replace a NaN by `math.nan`, because the compiler decides which of two NaN a sum has."""
    if math.isnan(numbers[place]):
        numbers[place] = math.nan


@kernel
def write_messages(chain, row, pins, estimate, stamp, m):
    """Write the messages of a layout.

    Parameters
    ----------
    chain : Chain
    row : ndarray
        Row of the prediction, see `boom_twin.kernels.result_row`.
    pins : int
        Number of pins with clearance.
    estimate : ndarray, shape (WIDTH,)
        Row of the estimate at the stamp of the prediction.
    stamp : int
        Stamp in all headers, ns.
    m : Layout
    """
    n = m.turns.shape[0] - 1
    results, estimates = results_in(row, n, pins), estimates_in(row, n, pins)
    for k in range(3):
        for a in range(3):
            m.numbers[3 * k + a] = results.tip[k, a]
    for a in range(2):
        m.numbers[DISPLACEMENT + a] = results.tip[0, a] - estimates.rigid_tip[a]
    for i in range(n):
        m.numbers[JOINTS + i] = results.joints[i]
        m.numbers[JOINTS + n + i] = estimates.strokes[i]
        m.numbers[JOINTS + 2 * n + i] = results.cylinder_forces[i]
    first = JOINTS + 3 * n
    for k in range(FORCE_VARIANCE):
        m.numbers[first + 3 + k] = estimate[k]
    write_turns(m.numbers, m.turns)
    for i in range(n + 1):
        m.turns[i, 1], m.turns[i, 2] = math.cos(m.turns[i, 0]), math.sin(m.turns[i, 0])
    derive(chain.pivot, chain.lengths, m.turns, m.numbers)
    for k in range(3):
        one_nan(m.numbers, first + k)
    for k in range(2):
        one_nan(m.numbers, first + 3 + FORCE_VARIANCE + k)
    put_numbers(m, stamp)


@kernel
def write_residuals(values, sigmas, row, stamp, m):
    """Write a message of residuals. Its layout has every channel three times: residual, normalised, standard deviation.

    Parameters
    ----------
    values, sigmas : ndarray, shape (k, w)
        Residuals and their standard deviations; those of `row` are written.
    stamp : int
        Stamp of the message, ns.
    m : Layout
    """
    n = m.chosen.shape[0] // 3
    for i in range(n):
        value, sigma = values[row, i], sigmas[row, i]
        m.numbers[i], m.numbers[n + i], m.numbers[2 * n + i] = value, value / sigma, sigma
    put_numbers(m, stamp)


@inner
def put_numbers(m, stamp):
    """Write numbers and stamp at their places in the messages."""
    for k in range(m.chosen.shape[0]):
        m.doubles[m.places[k]] = m.signs[k] * m.numbers[m.chosen[k]]
    seconds = stamp // SECOND
    for k in range(m.stamps.shape[0]):
        m.words[m.stamps[k] + SECONDS], m.words[m.stamps[k] + NANOSECONDS] = seconds, stamp - seconds * SECOND
