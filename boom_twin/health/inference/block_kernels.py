"""What blocks of residuals are made of, compiled: which blocks rows are of, the table of their linear problem."""

from __future__ import annotations

from ...kernels.jit import kernel


@kernel
def first_and_last(stamps, block):
    """Numbers of the first and of the last block, of `block` ns each, that any of `stamps` (k,) lies in; k > 0."""
    first = last = stamps[0]
    for k in range(stamps.shape[0]):
        first, last = min(first, stamps[k]), max(last, stamps[k])
    return first // block, last // block


@kernel
def largest_step(values, before):
    """The largest of the differences of two arrays (k,), as it is without its sign; NaN if one is."""
    largest = 0.0
    for i in range(values.shape[0]):
        step = abs(values[i] - before[i])
        if not step <= largest:
            largest = step
    return largest


@kernel
def write_table(table, left, signatures, late, rates, turns, turned, lengths, by_stroke, moved):
    """Write residuals and signatures of a block: those of its posture, and what depends on its motion.

    Parameters
    ----------
    table : ndarray, shape (c, 1 + parameters)
        See `boom_twin.health.inference.block_problem.BlockProblem`.
    left, signatures, rates : ndarray, shape (c,), (c, parameters), (c,)
        Residuals; signatures where they were made; rates of what was predicted.
    late : ndarray of int, shape (.., 3)
        Columns of lags, with the first of their channels and the one behind the last.
    turns, lengths : ndarray of int, shape (.., 2)
        Columns of scales of angles and of strokes, with their joints and cylinders.
    turned, by_stroke, moved : ndarray, shape (c,), (c, n), (n,)
        By how much readings and strokes (m) have changed since signatures were made; derivative of the ones by the others.
    """
    channels = left.shape[0]
    for i in range(channels):
        table[i, 0] = left[i]
        for j in range(signatures.shape[1]):
            table[i, 1 + j] = signatures[i, j]
        for k in range(late.shape[0]):
            table[i, late[k, 0]] = -rates[i] if late[k, 1] <= i < late[k, 2] else 0.0
        for k in range(lengths.shape[0]):
            table[i, lengths[k, 0]] -= by_stroke[i, lengths[k, 1]] * moved[lengths[k, 1]]
    for k in range(turns.shape[0]):
        table[turns[k, 1], turns[k, 0]] += turned[turns[k, 1]]
