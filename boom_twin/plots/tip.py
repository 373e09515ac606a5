"""Picture of the tip over time: displacement, acceleration, the load that is not known, and the IMU beside its prediction."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..types import Array
from .history import EstimateTrace, History, ImuTrace, Truth
from .style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PURPLE, broken, extent, legend_above, limits, picture, shade_gaps

if TYPE_CHECKING:
    from matplotlib.axes import Axes


WINDOW = 6.0  # s shown enlarged
TRUTH: dict[str, Any] = {"linewidth": 0.8, "linestyle": (0, (3, 4))}
AXES = (("x", BLUE), ("y", ORANGE))
ESTIMATED = (GREEN, PURPLE)
"""Colours of what all sensors together say of x and y."""
BAND = 2.0  # standard deviations that are shaded, as their label says


def tip_picture(path: Path, session: str, history: History, truth: Truth | None, note: str) -> None:
    """Write ``tip.png``."""
    window = most_active_window(history.stamps_s, history.tip_acceleration)
    estimate = history.estimate
    has_load = estimate is not None
    with picture(path, f"{session}: tip motion", note, (16.0, 12.0 if has_load else 9.0)) as figure:
        grid = figure.add_gridspec(3 + has_load, 2, height_ratios=[1.0, 1.0, *([0.8] * has_load), 1.1])
        upper = figure.add_subplot(grid[0, :])
        others = [figure.add_subplot(grid[1 + i, :], sharex=upper) for i in range(1 + has_load)]
        lower = [figure.add_subplot(grid[2 + has_load, i]) for i in range(2)]
        _displacement(upper, history, truth)
        _acceleration(others[0], history, truth)
        if estimate is not None:
            _load(others[1], history, estimate)
        _mark(others[0], window)
        for axes in (upper, *others[:-1]):
            axes.tick_params(labelbottom=False)
        others[-1].set_xlabel("time since first sample, s")
        if history.imu is not None:
            _imu(lower, history.imu, history, window)
        else:
            _enlarged(lower, history, truth, window)


def most_active_window(stamps: Array, acceleration: Array) -> tuple[float, float]:
    """Return the window of `WINDOW` s about the largest acceleration (m, 2), inside the session; all of a shorter session."""
    size = np.hypot(acceleration[:, 0], acceleration[:, 1])
    if not np.isfinite(size).any():
        return 0.0, WINDOW
    first, last = float(stamps[0]), float(stamps[-1])
    start = float(stamps[np.nanargmax(size)]) - 0.35 * WINDOW
    start = max(first, min(start, last - WINDOW))
    return start, min(start + WINDOW, max(last, first + 1e-3))


def rms_difference(history: History, values: Array, stamps: Array, other: Array) -> float:
    """Return the root mean square distance between `values` (m, 2) and `other` (t, 2), taken at the history's stamps."""
    gap = values - _at(history.stamps_s, stamps, other)
    return float(np.sqrt(np.nanmean(np.sum(gap**2, axis=1)))) if np.isfinite(gap).any() else float("nan")


def _at(stamps: Array, at: Array, values: Array) -> Array:
    """Return `values` (t, 2) known at `at`, linearly interpolated at `stamps`; NaN outside."""
    return np.stack([np.interp(stamps, at, column, left=np.nan, right=np.nan) for column in values.T], axis=1)


def _displacement(axes: Axes, history: History, truth: Truth | None) -> None:
    title, shown, estimate = "Displacement, x forward, y up", 1e3 * history.tip_displacement, history.estimate
    _lines(axes, history, shown)
    arrays = [shown]
    if estimate is not None:
        arrays += _estimate_lines(axes, history, 1e3 * estimate.displacement, 1e3 * estimate.displacement_sigmas)
    if truth is not None:
        rigid = history.tip_position - history.tip_displacement
        real = 1e3 * (_at(history.stamps_s, truth.stamps_s, truth.tip_position) - rigid)
        estimated = None if estimate is None else estimate.displacement + rigid
        title += _errors(history, (history.tip_position, estimated), (truth.stamps_s, truth.tip_position), (1e3, "mm"))
        _truth_lines(axes, history.stamps_s, real)
        arrays.append(real)
    axes.set_ylim(*limits(*arrays))
    axes.set_ylabel("displacement, mm")
    axes.set_title(title)
    _finish(axes, history)


def _acceleration(axes: Axes, history: History, truth: Truth | None) -> None:
    _lines(axes, history, history.tip_acceleration)
    title, arrays, estimate = "Acceleration, no gravity", [history.tip_acceleration], history.estimate
    if estimate is not None:
        arrays += _estimate_lines(axes, history, estimate.acceleration, estimate.acceleration_sigmas)
    if truth is not None:
        estimated = None if estimate is None else estimate.acceleration
        shown = history.tip_acceleration, estimated
        title += _errors(history, shown, (truth.stamps_s, truth.tip_acceleration), (1.0, "m/s²"))
        _truth_lines(axes, truth.stamps_s, truth.tip_acceleration)
        arrays.append(truth.tip_acceleration)
    axes.set_ylim(*limits(*arrays, around=0.0))
    axes.set_ylabel("acceleration, m/s²")
    axes.set_title(title)
    _finish(axes, history)


def _load(axes: Axes, history: History, estimate: EstimateTrace) -> None:
    arrays = _estimate_lines(axes, history, estimate.load, estimate.load_sigmas)
    axes.set_ylim(*limits(*arrays, around=0.0))
    axes.set_ylabel("force, N")
    axes.set_title(f"Load at the tip that the model does not know: {history.load_text}")
    _finish(axes, history)


def _errors(history: History, shown: tuple[Array, Array | None], truth: tuple[Array, Array], unit: tuple[float, str]) -> str:
    """Return errors of prediction and estimate (m, 2) against the truth, its stamps and values (t, 2), for a title."""
    factor, name = unit
    errors = [None if values is None else factor * rms_difference(history, values, *truth) for values in shown]
    told = [f"{kind} {error:.2g}" for kind, error in zip(("prediction", "estimate"), errors, strict=True) if error is not None]
    return f"; rms error: {', '.join(told)} {name}"


def _estimate_lines(axes: Axes, history: History, values: Array, sigmas: Array) -> list[Array]:
    """Draw an estimate (m, 2) with its band; return the extent to show: the lines, and where the band usually ends."""
    stamps, drawn = broken(history.stamps_s, values, history.gaps)
    _, deviations = broken(history.stamps_s, sigmas, history.gaps)
    for i, (name, colour) in enumerate(zip("xy", ESTIMATED, strict=True)):
        axes.plot(stamps, drawn[:, i], color=colour, linewidth=1.0, label=f"estimated {name}{', ±2 sigma' if i else ''}")
        low, high = drawn[:, i] - BAND * deviations[:, i], drawn[:, i] + BAND * deviations[:, i]
        axes.fill_between(stamps, low, high, color=colour, alpha=0.22, linewidth=0)
    usual = BAND * np.nanmedian(sigmas, axis=0)
    return [values - usual, values + usual]


def _lines(axes: Axes, history: History, values: Array) -> None:
    stamps, drawn = broken(history.stamps_s, values, history.gaps)
    for i, (name, colour) in enumerate(AXES):
        axes.plot(stamps, drawn[:, i], color=colour, label=f"predicted {name}")


def _truth_lines(axes: Axes, stamps: Array, values: Array) -> None:
    for i in range(2):
        axes.plot(stamps, values[:, i], color=INK, **TRUTH, label="" if i else "truth")


def _finish(axes: Axes, history: History) -> None:
    shade_gaps(axes, history.gaps)
    axes.set_xlim(extent(history.stamps_s))
    legend_above(axes, 5, 0.99, handlelength=1.6, columnspacing=1.1)


def _mark(axes: Axes, window: tuple[float, float]) -> None:
    """Shade the part of the session that is shown enlarged."""
    axes.axvspan(*window, color=PALE, alpha=0.6, linewidth=0, zorder=0.4)
    left, right = axes.get_xlim()
    late = sum(window) > left + right
    place, side = (window[0], "right") if late else (window[1], "left")
    text = "enlarged below"
    frame = axes.get_xaxis_transform()
    axes.annotate(
        text, (place, 0.04), xycoords=frame, xytext=(-4 if late else 4, 0), textcoords="offset points", ha=side,
        fontsize=11, color=GREY,
    )  # fmt: skip


def _imu(panels: list[Axes], imu: ImuTrace, history: History, window: tuple[float, float]) -> None:
    inside = (imu.stamps_s >= window[0]) & (imu.stamps_s <= window[1])
    for i, (axes, name) in enumerate(zip(panels, ("x, along the tip", "z, across it"), strict=True)):
        measured, predicted = imu.measured[inside, i], imu.predicted[inside, i]
        axes.plot(imu.stamps_s[inside], measured, color=GREY, linewidth=0.9, label="measured")
        axes.plot(imu.stamps_s[inside], predicted, color=AXES[i][1], linewidth=1.6, label="predicted")
        axes.set_ylim(*limits(measured, predicted))
        axes.set_title(f"Specific force {name}")
        axes.set_ylabel("specific force, m/s²")
        _window(axes, history, window)


def _enlarged(panels: list[Axes], history: History, truth: Truth | None, window: tuple[float, float]) -> None:
    inside = (history.stamps_s >= window[0]) & (history.stamps_s <= window[1])
    for i, (axes, (name, colour)) in enumerate(zip(panels, AXES, strict=True)):
        shown = [history.tip_acceleration[inside, i]]
        axes.plot(history.stamps_s[inside], shown[0], color=colour, label="predicted")
        if truth is not None:
            there = (truth.stamps_s >= window[0]) & (truth.stamps_s <= window[1])
            shown.append(truth.tip_acceleration[there, i])
            axes.plot(truth.stamps_s[there], shown[1], color=INK, **TRUTH, label="truth")
        axes.set_ylim(*limits(*shown))
        axes.set_title(f"Tip acceleration {name}")
        axes.set_ylabel("acceleration, m/s²")
        _window(axes, history, window)


def _window(axes: Axes, history: History, window: tuple[float, float]) -> None:
    shade_gaps(axes, [gap for gap in history.gaps if gap[0] < window[1] and gap[1] > window[0]])
    axes.set_xlim(*window)
    axes.set_xlabel("time since first sample, s")
    legend_above(axes, 3, 0.99, handlelength=1.6)
