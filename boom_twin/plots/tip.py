"""Picture of the tip over time: displacement, acceleration, and the IMU beside its prediction."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..types import Array
from .history import History, ImuTrace, Truth
from .style import BLUE, GREY, INK, ORANGE, PALE, broken, extent, legend_above, limits, picture, shade_gaps

if TYPE_CHECKING:
    from matplotlib.axes import Axes


WINDOW = 6.0  # s shown enlarged
TRUTH: dict[str, Any] = {"color": INK, "linewidth": 0.8, "linestyle": (0, (3, 4))}
AXES = (("x (forward)", BLUE), ("y (up)", ORANGE))


def tip_picture(path: Path, session: str, history: History, truth: Truth | None, note: str) -> None:
    """Write ``tip.png``."""
    window = most_active_window(history.stamps_s, history.tip_acceleration)
    with picture(path, f"{session}: tip motion", note) as figure:
        grid = figure.add_gridspec(3, 2, height_ratios=[1.0, 1.0, 1.1])
        upper = figure.add_subplot(grid[0, :])
        middle = figure.add_subplot(grid[1, :], sharex=upper)
        lower = [figure.add_subplot(grid[2, i]) for i in range(2)]
        beside = _beside(truth)
        _displacement(upper, history, beside)
        _acceleration(middle, history, beside)
        _mark(middle, window)
        upper.tick_params(labelbottom=False)
        middle.set_xlabel("time since first sample, s")
        if history.imu is not None:
            _imu(lower, history.imu, history, window)
        else:
            _enlarged(lower, history, beside, window)


def most_active_window(stamps: Array, acceleration: Array) -> tuple[float, float]:
    """Window of `WINDOW` s about the largest acceleration (m, 2), inside the session; all of it if that is shorter."""
    size = np.hypot(acceleration[:, 0], acceleration[:, 1])
    if not np.isfinite(size).any():
        return 0.0, WINDOW
    first, last = float(stamps[0]), float(stamps[-1])
    start = float(stamps[np.nanargmax(size)]) - 0.35 * WINDOW
    start = max(first, min(start, last - WINDOW))
    return start, min(start + WINDOW, max(last, first + 1e-3))


def rms_difference(history: History, values: Array, stamps: Array, other: Array) -> float:
    """Root mean square of the distance between `values` (m, 2) and `other` (t, 2), taken at the history's stamps."""
    gap = values - _at(history.stamps_s, stamps, other)
    return float(np.sqrt(np.nanmean(np.sum(gap**2, axis=1)))) if np.isfinite(gap).any() else float("nan")


def _at(stamps: Array, at: Array, values: Array) -> Array:
    """`values` (t, 2) known at `at`, linearly at `stamps`; NaN outside."""
    return np.stack([np.interp(stamps, at, column, left=np.nan, right=np.nan) for column in values.T], axis=1)


@dataclass(frozen=True)
class _Beside:
    """Motion of the tip by another source than the prediction, drawn beside it: as `Truth`, its name and how it is drawn."""

    name: str
    motion: Truth
    style: dict[str, Any]


def _beside(truth: Truth | None) -> list[_Beside]:
    return [] if truth is None else [_Beside("truth", truth, TRUTH)]


def _displacement(axes: Axes, history: History, beside: list[_Beside]) -> None:
    shown = 1e3 * history.tip_displacement
    _lines(axes, history, shown, "predicted ")
    arrays = [shown]
    for each in beside:
        stamps, position = each.motion.stamps_s, each.motion.tip_position
        rigid = history.tip_position - history.tip_displacement
        real = 1e3 * (_at(history.stamps_s, stamps, position) - rigid)
        error = 1e3 * rms_difference(history, history.tip_position, stamps, position)
        _other_lines(axes, history.stamps_s, real, each, f"{each.name} (tip apart by {error:.2g} mm rms)")
        arrays.append(real)
    axes.set_ylim(*limits(*arrays))
    axes.set_ylabel("displacement, mm")
    axes.set_title("Tip displacement against a rigid boom on the same strokes")
    _finish(axes, history)


def _acceleration(axes: Axes, history: History, beside: list[_Beside]) -> None:
    _lines(axes, history, history.tip_acceleration, "predicted ")
    arrays = [history.tip_acceleration]
    for each in beside:
        stamps, acceleration = each.motion.stamps_s, each.motion.tip_acceleration
        error = rms_difference(history, history.tip_acceleration, stamps, acceleration)
        _other_lines(axes, stamps, acceleration, each, f"{each.name} (apart by {error:.2g} m/s² rms)")
        arrays.append(acceleration)
    axes.set_ylim(*limits(*arrays, around=0.0))
    axes.set_ylabel("acceleration, m/s²")
    axes.set_title("Tip acceleration (of the point, without gravity)")
    _finish(axes, history)


def _lines(axes: Axes, history: History, values: Array, prefix: str) -> None:
    stamps, drawn = broken(history.stamps_s, values, history.gaps)
    for i, (name, colour) in enumerate(AXES):
        axes.plot(stamps, drawn[:, i], color=colour, label=prefix + name)


def _other_lines(axes: Axes, stamps: Array, values: Array, each: _Beside, label: str) -> None:
    for i in range(2):
        axes.plot(stamps, values[:, i], **each.style, label="" if i else label)


def _finish(axes: Axes, history: History) -> None:
    shade_gaps(axes, history.gaps)
    axes.set_xlim(extent(history.stamps_s))
    legend_above(axes, 5, 0.99, handlelength=1.6)


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


def _enlarged(panels: list[Axes], history: History, beside: list[_Beside], window: tuple[float, float]) -> None:
    inside = (history.stamps_s >= window[0]) & (history.stamps_s <= window[1])
    for i, (axes, (name, colour)) in enumerate(zip(panels, AXES, strict=True)):
        shown = [history.tip_acceleration[inside, i]]
        axes.plot(history.stamps_s[inside], shown[0], color=colour, label="predicted")
        for each in beside:
            stamps = each.motion.stamps_s
            there = (stamps >= window[0]) & (stamps <= window[1])
            shown.append(each.motion.tip_acceleration[there, i])
            axes.plot(stamps[there], shown[-1], **each.style, label=each.name)
        axes.set_ylim(*limits(*shown))
        axes.set_title(f"Tip acceleration {name}")
        axes.set_ylabel("acceleration, m/s²")
        _window(axes, history, window)


def _window(axes: Axes, history: History, window: tuple[float, float]) -> None:
    shade_gaps(axes, [gap for gap in history.gaps if gap[0] < window[1] and gap[1] > window[0]])
    axes.set_xlim(*window)
    axes.set_xlabel("time since first sample, s")
    legend_above(axes, 3, 0.99, handlelength=1.6)
