"""Kalman filter of several columns at once, compiled: prediction and correction of a block, for every level of the load."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...kernels.jit import by_reference, inner, kernel
from ...types import Array

LOAD = 4  # states of the load: x and y about the mean, and the mean's


@by_reference
class FilterWork(NamedTuple):
    """What `filter_block` goes on with; l levels of the load, c channels, s states, the last c the errors of the channels.

    turn, least, driven : (s, s) what states become within a block; covariance that stroke noise adds, and that wrong
    frequencies add for a mean square of the tip's acceleration of 1 (m/s^2)^2 and a detuning of 1.
    detuning2, shape2 : (l,) squares of the shares by which frequencies, and what the means read of vibration, may be wrong.
    added : (l, s) variances that come with a block; those of the errors of the channels are written.
    shown : (c, s) how the means of the channels read the states.
    shaken, rough, pushed : (c,), (l, c), (l,) variance of the means for a mean square of the tip's acceleration of
    1 (m/s^2)^2 and shapes that are wrong by all of it, by the load, and that mean square by it.
    swinging : (l,) mean square of the tip's acceleration by vibration that was found, (m/s^2)^2.
    x, p : (l, s, columns), (l, s, s) states and covariance.
    rows, own, scratch, root, gain : (c,), (c,), (s, the larger of s and columns), (c, c), (c, s) scratch.
    """

    turn: Array
    least: Array
    driven: Array
    detuning2: Array
    shape2: Array
    added: Array
    shown: Array
    shaken: Array
    rough: Array
    pushed: Array
    swinging: Array
    x: Array
    p: Array
    rows: NDArray[np.int64]
    own: Array
    scratch: Array
    root: Array
    gain: Array


@kernel
def filter_block(f, table, noise, errors2, shaking, kept, calm, white, log):
    """`predict` and `correct` for every level; gives how many channels were measured.

    Parameters
    ----------
    f : FilterWork
    table, noise, errors2 : ndarray
        See `boom_twin.health.inference.innovation_filter.InnovationFilter.step`.
    shaking : ndarray, shape (l,)
        (m/s^2)^2.
    kept, calm : float
        Share of the errors of the channels, and of the mean square of vibration found, that is left after a block.
    white, log : ndarray, shape (l, c, columns), (l,)
        Written; rows of channels that were not measured are left out. A log that is NaN: not positive definite.
    """
    (channels, states), measured = f.shown.shape, 0
    errors = states - channels
    for i in range(channels):
        f.turn[errors + i, errors + i] = kept
        if math.isfinite(table[i, 0]):
            f.rows[measured] = i
            measured += 1
    for k in range(f.x.shape[0]):
        shaken = shaking[k] + f.pushed[k]
        for i in range(channels):
            f.added[k, errors + i] = (1.0 - kept * kept) * errors2[i]
            f.own[i] = f.shape2[k] * shaken * f.shaken[i] + f.rough[k, i]
        predict(f.turn, f.least, f.driven, f.detuning2[k] * shaken, f.added[k], f.x[k], f.p[k], f.scratch)
        log[k] = correct(f.rows[:measured], table, f.shown, noise, f.own, f.x[k], f.p[k], f.root, f.gain, white[k])
        felt2 = 0.0
        for i in range(channels - 2, channels):
            felt = 0.0
            for j in range(errors - LOAD):
                felt += f.shown[i, j] * f.x[k, j, 0]
            felt2 += felt * felt
        f.swinging[k] = max(f.swinging[k] * calm, 0.5 * felt2)
    return measured


@inner
def predict(turn, least, driven, shaking, added, x, p, scratch):
    """State x, one in each column, and covariance p of the next block, before it is measured: p = turn p turn' + noise.

    The noise is ``least + shaking * driven``, and the variances `added`.
    """
    states, columns = x.shape
    for i in range(states):
        multiply_row(turn, i, x, scratch, columns)
    for i in range(states):
        for c in range(columns):
            x[i, c] = scratch[i, c]
    for i in range(states):
        multiply_row(turn, i, p, scratch, states)
    for i in range(states):
        for j in range(i + 1):
            total = least[i, j] + shaking * driven[i, j]
            for k in range(states):
                total += scratch[i, k] * turn[j, k]
            p[i, j] = p[j, i] = total
        p[i, i] += added[i]


@inner
def multiply_row(a, i, b, product, columns):
    """Row i of a b, of which many coefficients of a are 0."""
    for c in range(columns):
        product[i, c] = 0.0
    for k in range(a.shape[1]):
        if a[i, k] != 0.0:
            for c in range(columns):
                product[i, c] += a[i, k] * b[k, c]


@kernel
def correct(rows, table, shown, noise, own, x, p, root, gain, white):
    """Innovations of the channels in `rows`, by which state and covariance are corrected; gives the ln of their probability.

    ``root`` (rows, rows) and ``gain`` (rows, states) are scratch; the result is NaN where the covariance of innovations,
    ``noise`` and the variances `own` of the channels among it, is not positive definite.
    """
    measured, (states, columns) = rows.shape[0], x.shape
    log = 0.0
    for a in range(measured):
        row = rows[a]
        for c in range(columns):
            white[a, c] = table[row, c]
        for c in range(states):
            gain[a, c] = 0.0
        for k in range(states):
            by = shown[row, k]
            if by != 0.0:
                for c in range(columns):
                    white[a, c] -= by * x[k, c]
                for c in range(states):
                    gain[a, c] += by * p[k, c]
        for b in range(a + 1):
            total = noise[row, rows[b]]
            if a == b:
                total += own[row]
            for k in range(states):
                total += shown[rows[b], k] * gain[a, k]
            root[a, b] = total
    for a in range(measured):
        for b in range(a):
            for k in range(b):
                root[a, b] -= root[a, k] * root[b, k]
            root[a, b] /= root[b, b]
            root[a, a] -= root[a, b] * root[a, b]
            for c in range(columns):
                white[a, c] -= root[a, b] * white[b, c]
            for c in range(states):
                gain[a, c] -= root[a, b] * gain[b, c]
        root[a, a] = math.sqrt(root[a, a])
        for c in range(columns):
            white[a, c] /= root[a, a]
        for c in range(states):
            gain[a, c] /= root[a, a]
        log -= 0.5 * white[a, 0] * white[a, 0] + math.log(root[a, a])
    for a in range(measured):
        for i in range(states):
            for c in range(columns):
                x[i, c] += gain[a, i] * white[a, c]
            for c in range(states):
                p[i, c] -= gain[a, i] * gain[a, c]
    return log


@kernel
def has_strayed(mean, covariance, mean_before, variances_before, deviations, least):
    """Whether parameters were learnt to be off by so many deviations of what was learnt, `least` of the variances or more."""
    for i in range(mean.shape[0]):
        learnt, off = variances_before[i] - covariance[i, i], mean[i] - mean_before[i]
        if off * off > deviations * deviations * max(learnt, least * variances_before[i]):
            return True
    return False
