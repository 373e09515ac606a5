"""Uneven times of samples, where they break off and how far apart they are; power spectral density of even ones."""

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


def power_density(values: Array, interval: float, segment: int) -> tuple[Array, Array, int]:
    """Return frequencies (lines,), one-sided power spectral density (lines,) or (lines, c) per Hz, and number of segments.

    Welch's method: Hann window, half overlap, means removed, `segment` values a segment of `values` (k,) or (k, c) at even
    times, `interval` s apart. ``scipy.signal.welch`` gives the same, but takes half a second to import.
    """
    parts = np.lib.stride_tricks.sliding_window_view(values, segment, axis=0)[:: segment - segment // 2]
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(segment) / segment)
    lines = np.fft.rfft(window * (parts - parts.mean(axis=-1, keepdims=True)), axis=-1)
    power = 2.0 * interval * np.square(np.abs(lines)).mean(axis=0) / np.square(window).sum()
    power[..., 0] *= 0.5
    if segment % 2 == 0:
        power[..., -1] *= 0.5  # these two lines have no twin at a negative frequency
    return np.asarray(np.fft.rfftfreq(segment, interval)), np.asarray(power.T), len(parts)
