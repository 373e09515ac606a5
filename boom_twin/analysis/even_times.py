"""Times of samples before they are brought to even spacing: where they break off, and how far apart they are."""

from __future__ import annotations

import numpy as np

from ..types import Array

BREAK = 1.0  # step of time, s, that is not bridged; neither is a step back


def unbroken(times: Array) -> list[slice]:
    """Return the parts of `times` (n,) in s that have no break; the memory of even times goes by samples in each."""
    steps = np.diff(times)
    cuts = (np.flatnonzero((steps < 0.0) | (steps > BREAK)) + 1).tolist()
    return [slice(first, stop) for first, stop in zip([0, *cuts], [*cuts, len(times)], strict=True)]


def spacing(times: Array) -> float:
    """Return the usual distance of ascending `times` (n,) in s: their median, at least half the mean."""
    return max(float(np.median(np.diff(times))), 0.5 * float(times[-1] - times[0]) / (len(times) - 1))
