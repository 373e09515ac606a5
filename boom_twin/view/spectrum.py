"""Picture of the tip's spectrum: Welch power spectral density of what was predicted and, with an IMU, measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import welch

from ..records import Array
from .records import History
from .style import BLUE, GREY, ORANGE, picture

SEGMENT = 8.0  # s; lines of the spectrum are 1/SEGMENT apart
SHORTEST = 4.0  # s; no spectrum of less


def spectrum_picture(path: Path, session: str, history: History, note: str) -> None:
    """Write ``spectrum.png``: specific force if there is an IMU, else tip acceleration."""
    imu = history.imu
    stamps = history.stamps_s if imu is None else imu.stamps_s
    quantity = "tip acceleration" if imu is None else "specific force at the tip"
    names = ("x (forward)", "y (up)") if imu is None else ("x, along the tip", "z, across it")
    with picture(path, f"{session}: spectrum of the {quantity}", note) as figure:
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        for i, axes in enumerate(panels):
            predicted = history.tip_acceleration[:, i] if imu is None else imu.predicted[:, i]
            if imu is not None:
                axes.loglog(*density(stamps, imu.measured[:, i]), color=GREY, label="measured")
            axes.loglog(*density(stamps, predicted), color=(BLUE, ORANGE)[i], linewidth=1.8, label="predicted")
            axes.set_title(f"{quantity[0].upper()}{quantity[1:]}, {names[i]}")
            axes.set_xlabel("frequency, Hz")
            axes.legend(loc="upper right")
        panels[0].set_ylabel("power spectral density, (m/s²)²/Hz")
        text = f"Welch, segments of {SEGMENT:g} s, Hann window, mean removed"
        panels[0].text(0.02, 0.02, text, transform=panels[0].transAxes, fontsize=11, color=GREY)


def has_spectrum(history: History) -> bool:
    """Whether the session is long enough."""
    return bool(len(history.stamps_s) > 16 and history.stamps_s[-1] - history.stamps_s[0] >= SHORTEST)


def density(stamps: Array, values: Array) -> tuple[Array, Array]:
    """Frequencies (Hz) and one-sided density of `values` (k,), put on even times first; what is NaN is bridged."""
    known = np.isfinite(values)
    if known.sum() < 16:
        return np.array([1.0]), np.array([np.nan])
    interval = float(np.median(np.diff(stamps[known])))
    even = np.arange(stamps[known][0], stamps[known][-1], interval)
    segment = min(len(even), round(SEGMENT / interval))
    frequencies, power = welch(np.interp(even, stamps[known], values[known]), 1.0 / interval, nperseg=segment)
    return frequencies[1:], power[1:]
