"""Rest periods of strokes, and the share of the strokes' noise that is left in them.

A stroke that holds is known by the mean of all its readings over the hold, some thirty times as well as by a smoother that has
to follow moves. What noise is left in the strokes shakes the model as no boom is shaken, and what it makes of the predictions
it makes of their derivatives, too: a fit takes it for motion (errors in variables; Soederstroem 2007, Automatica 43).
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..types import Array

LOOK, CLEAR = 0.5, 0.2  # s, over which a stroke is looked at, and that are left to a move at its ends
SHORTEST = 1.0  # s, of what is then left of a hold
BLEND = 0.15  # s, from the smoothed stroke to the held one, and back
LIKELY = 2.0  # of the deviation that noise makes of a smoothed stroke, root of the mean square over `LOOK`: it moves


def held(smoothed: Array, deviation: float, step: float) -> tuple[Array, Array]:
    """Return strokes with their means in rest periods, and the share of their own noise that is left in them.

    Parameters
    ----------
    smoothed : ndarray, shape (m, n)
        Strokes on a grid of `step` (s), smoothed, m.
    deviation : float
        Standard deviation that noise has in `smoothed`, m.

    Returns
    -------
    strokes : ndarray, shape (m, n)
    moving : ndarray, shape (m, n)
        From 0, held, to 1, smoothed.
    """
    moving, found = np.ones(smoothed.shape), smoothed.copy()
    blend = max(1, round(BLEND / step))
    ease = 0.5 - 0.5 * np.cos(np.pi * (np.arange(blend) + 0.5) / blend)
    for i, column in enumerate(smoothed.T):
        for first, last in _stretches(column, deviation, step):
            weight = np.zeros(last - first)
            if first > 0:
                weight[:blend] = ease[::-1]
            if last < len(column):
                weight[-blend:] = ease
            moving[first:last, i] = weight
            found[first:last, i] = weight * column[first:last] + (1.0 - weight) * column[first:last].mean()
    return found, moving


def _stretches(column: Array, deviation: float, step: float) -> list[tuple[int, int]]:
    """Return the rest periods of one stroke: first row, and the row after the last."""
    look, clear, most = round(LOOK / step), round(CLEAR / step), (LIKELY * deviation) ** 2
    if len(column) < look:
        return []
    quiet = sliding_window_view(column, look).var(axis=1) < most
    still = np.convolve(quiet, np.ones(look)) > 0.5
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int))).reshape(-1, 2).tolist()
    found = [(a + (clear if a else 0), b - (clear if b < len(column) else 0)) for a, b in edges]
    return [(a, b) for a, b in found if b - a >= SHORTEST / step and column[a:b].var() < most]
