"""Kalman filter of several columns at once, compiled: prediction and correction of a block, for every level of the load."""

from __future__ import annotations

import math

from ...kernels.jit import inner, kernel


@kernel
def filter_block(turn, least, driven, shaking, added, rows, table, shown, noise, own, x, p, scratch, root, gain, white, log):
    """`predict` and `correct` for every level, the first axis of what depends on it."""
    for k in range(x.shape[0]):
        predict(turn, least, driven, shaking[k], added[k], x[k], p[k], scratch)
        log[k] = correct(rows, table, shown, noise, own[k], x[k], p[k], root, gain, white[k])


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
