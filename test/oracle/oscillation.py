"""What a free oscillation tells of itself."""

from __future__ import annotations

import numpy as np


def mean_frequency(times, signal):
    """Of the rising zero crossings of a signal about its mean (Hz)."""
    signal = signal - signal.mean()
    rising = np.flatnonzero((signal[:-1] < 0) & (signal[1:] >= 0))
    crossings = times[rising] - signal[rising] * (times[1] - times[0]) / (signal[rising + 1] - signal[rising])
    return (len(crossings) - 1) / (crossings[-1] - crossings[0])
