"""Pictures of one replayed session: the tip over time, the deflected boom through the session."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..system.child_call import ChildCall, ChildEndedError
from ..system.processes import beside, usable_cores
from ..types import Array
from .history import History, Truth
from .residuals import has_spectrum, residual_picture, spectrum_picture
from .style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PALE,
    TIME,
    broken,
    colours_of_times,
    draw_base,
    extent,
    import_plotting,
    legend_above,
    limits,
    picture,
    shade_gaps,
    side_view,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes


ENLARGED_SPAN = 6.0  # s shown enlarged
TRUTH: dict[str, Any] = {"color": INK, "linewidth": 0.8, "linestyle": (0, (3, 4))}
COLOURS = (BLUE, ORANGE)  # of x and y; a prediction is a broad pale line, an estimate a thin dark one over it
BROAD: dict[str, Any] = {"linewidth": 3.2, "alpha": 0.4}


def replay_pictures(
    directory: Path, history: History, truth: Truth | None = None, *, session: str = "session", note: str = ""
) -> list[Path]:
    """Draw what was replayed into a directory, which is made if it is not there; return the written files.

    These are ``tip.png``, ``residuals.png`` (if there are channels), ``posture.png`` (if there are shapes), ``spectrum.png``
    (from 4 s on). `session` is its name for the titles, and `note` small print.
    """
    if len(history.stamps_s) == 0:
        return []
    directory.mkdir(parents=True, exist_ok=True)
    import_plotting()
    tip, residuals, posture, spectrum = (directory / f"{name}.png" for name in ("tip", "residuals", "posture", "spectrum"))
    is_drawn = {tip: True, residuals: history.residuals, posture: history.shapes, spectrum: has_spectrum(history)}

    def draw_half() -> None:
        tip_picture(tip, session, history, truth, note)
        if is_drawn[spectrum]:
            spectrum_picture(spectrum, session, history, note)

    with beside(draw_half):
        if is_drawn[residuals]:
            residual_picture(residuals, session, history, note)
        if is_drawn[posture]:
            posture_picture(posture, session, history, note)
    return [path for path, is_there in is_drawn.items() if is_there]


Painter = Callable[..., list[Path]]  # as `replay_pictures`


@contextmanager
def painter() -> Iterator[Painter]:
    """Provide `replay_pictures`. With a second core, a child process imports matplotlib at once, and draws."""
    if usable_cores() < 2:
        yield replay_pictures
        return

    def draw(*given: Any, **named: Any) -> list[Path]:
        try:
            paths: list[Path] = child(*given, **named)
        except ChildEndedError:
            paths = replay_pictures(*given, **named)
        return paths

    with closing(ChildCall(_prepared, is_urgent=True)) as child:
        yield draw


def _prepared() -> Painter:
    import_plotting()
    return replay_pictures


class Panel(NamedTuple):
    """Quantity of the tip over a session: predicted (m, 2), estimated with deviations, true with its stamps."""

    title: str
    label: str  # of its axis, with the unit at the end
    predicted: Array | None
    estimated: tuple[Array, Array] | None
    true: tuple[Array, Array] | None = None
    around: float | None = 0.0  # middle of the axis


def tip_picture(path: Path, session: str, history: History, truth: Truth | None, note: str) -> None:
    """Write ``tip.png``."""
    window, panels = most_active_window(history.stamps_s, history.tip_acceleration), _panels(history, truth)
    count = len(panels)
    with picture(path, f"{session}: tip motion", note, (16.0, 3.0 * (count + 1))) as figure:
        grid = figure.add_gridspec(count + 1, 2, height_ratios=[*[1.0, 1.0, 0.8][:count], 1.1])
        shown: list[Axes] = []
        for row, panel in enumerate(panels):
            shown.append(figure.add_subplot(grid[row, :], sharex=shown[0] if shown else None))
            _over_session(shown[-1], history, panel)
            shown[-1].tick_params(labelbottom=row == count - 1)
        shown[-1].set_xlabel(TIME)
        _mark(shown[1], window)
        for column in range(2):
            _enlarged(figure.add_subplot(grid[count, column]), history, truth, window, column)


def most_active_window(stamps: Array, acceleration: Array) -> tuple[float, float]:
    """Return the span of `ENLARGED_SPAN` s about the largest acceleration (m, 2) in a session; all of a shorter session."""
    size = np.hypot(acceleration[:, 0], acceleration[:, 1])
    if not np.isfinite(size).any():
        return 0.0, ENLARGED_SPAN
    first, last = float(stamps[0]), float(stamps[-1])
    start = float(stamps[np.nanargmax(size)]) - 0.35 * ENLARGED_SPAN
    start = max(first, min(start, last - ENLARGED_SPAN))
    return start, min(start + ENLARGED_SPAN, max(last, first + 1e-3))


def _panels(history: History, truth: Truth | None) -> list[Panel]:
    estimate, place, acceleration = history.estimate, None, None
    if truth is not None:
        rigid = history.tip_position - history.tip_displacement
        place = history.stamps_s, 1e3 * (_at(history.stamps_s, truth.stamps_s, truth.tip_position) - rigid)
        acceleration = truth.stamps_s, truth.tip_acceleration
    found: list[tuple[Array, Array] | None] = [None, None, None]
    if estimate is not None:
        displaced = 1e3 * estimate.displacement, 1e3 * estimate.displacement_sigmas
        found = [displaced, (estimate.acceleration, estimate.acceleration_sigmas), (estimate.load, estimate.load_sigmas)]
    title = f"Load at the tip that the model does not know: {history.load_text}"
    panels = [
        Panel("Displacement, x forward, y up", "displacement, mm", 1e3 * history.tip_displacement, found[0], place, None),
        Panel("Acceleration, no gravity", "acceleration, m/s²", history.tip_acceleration, found[1], acceleration),
        Panel(title, "force, N", None, found[2]),
    ]
    return panels if estimate is not None else panels[:2]


def _at(stamps: Array, at: Array, values: Array) -> Array:
    """Return `values` (t, 2) known at `at`, linearly interpolated at `stamps`; NaN outside."""
    return np.stack([np.interp(stamps, at, column, left=np.nan, right=np.nan) for column in values.T], axis=1)


def _over_session(axes: Axes, history: History, panel: Panel) -> None:
    band = 2.0  # standard deviations that are shaded, as their label says
    extents, errors = [], []
    if panel.predicted is not None:
        stamps, drawn = broken(history.stamps_s, panel.predicted, history.gaps)
        for name, column, colour in zip("xy", drawn.T, COLOURS, strict=True):
            axes.plot(stamps, column, color=colour, label=f"predicted {name}", **BROAD)
        extents.append(panel.predicted)
        errors.append(("prediction", panel.predicted))
    if panel.estimated is not None:
        values, sigmas = panel.estimated
        stamps, drawn = broken(history.stamps_s, values, history.gaps)
        _, bands = broken(history.stamps_s, band * sigmas, history.gaps)
        for i, colour in enumerate(COLOURS):
            label = f"estimated {'xy'[i]}{', ±2 sigma' if i else ''}"
            axes.plot(stamps, drawn[:, i], color=colour, linewidth=1.0, label=label)
            low, high = drawn[:, i] - bands[:, i], drawn[:, i] + bands[:, i]
            axes.fill_between(stamps, low, high, color=colour, alpha=0.22, linewidth=0)
        usual = band * np.nanmedian(sigmas, axis=0)
        extents += [values - usual, values + usual]
        errors.append(("estimate", values))
    title = panel.title
    if panel.true is not None:
        there = _at(history.stamps_s, *panel.true)
        told = ", ".join(f"{kind} {_rms(values - there):.2g}" for kind, values in errors)
        title += f"; rms error: {told} {panel.label.split()[-1]}"
        for i in range(2):
            axes.plot(panel.true[0], panel.true[1][:, i], **TRUTH, label="" if i else "truth")
        extents.append(panel.true[1])
    axes.set_ylim(*limits(*extents, around=panel.around))
    axes.set_ylabel(panel.label)
    axes.set_title(title)
    shade_gaps(axes, history.gaps)
    axes.set_xlim(extent(history.stamps_s))
    legend_above(axes, 5, 0.99, handlelength=1.6, columnspacing=1.1)


def _rms(gap: Array) -> float:
    return float(np.sqrt(np.nanmean(np.sum(gap**2, axis=1)))) if np.isfinite(gap).any() else float("nan")


def _mark(axes: Axes, window: tuple[float, float]) -> None:
    axes.axvspan(*window, color=PALE, alpha=0.6, linewidth=0, zorder=0.4)
    late = sum(window) > sum(axes.get_xlim())
    place, shift, side = (window[0], -4, "right") if late else (window[1], 4, "left")
    axes.annotate(
        "enlarged below", (place, 0.04), xycoords=axes.get_xaxis_transform(), xytext=(shift, 0),
        textcoords="offset points", ha=side, fontsize=11, color=GREY,
    )  # fmt: skip


def _enlarged(axes: Axes, history: History, truth: Truth | None, window: tuple[float, float], i: int) -> None:
    """Draw component `i` of the IMU's specific force in the window, or of the tip's acceleration without an IMU."""
    curves: list[tuple[str, Array, Array, dict[str, Any]]] = []
    if history.imu is not None:
        title, label = f"Specific force {('x, along the tip', 'z, across it')[i]}", "specific force, m/s²"
        curves.append(("measured", history.imu.stamps_s, history.imu.measured, {"color": GREY, "linewidth": 0.9}))
        curves.append(("predicted", history.imu.stamps_s, history.imu.predicted, {"color": COLOURS[i], "linewidth": 1.6}))
    else:
        title, label = f"Tip acceleration {'xy'[i]}", "acceleration, m/s²"
        curves.append(("predicted", history.stamps_s, history.tip_acceleration, {"color": COLOURS[i]}))
        if truth is not None:
            curves.append(("truth", truth.stamps_s, truth.tip_acceleration, TRUTH))
    shown = []
    for name, stamps, values, look in curves:
        inside = (stamps >= window[0]) & (stamps <= window[1])
        shown.append(values[inside, i])
        axes.plot(stamps[inside], shown[-1], label=name, **look)
    axes.set_ylim(*limits(*shown))
    axes.set_title(title)
    axes.set_ylabel(label)
    shade_gaps(axes, [gap for gap in history.gaps if gap[0] < window[1] and gap[1] > window[0]])
    axes.set_xlim(*window)
    axes.set_xlabel(TIME)
    legend_above(axes, 3, 0.99, handlelength=1.6)


def posture_picture(path: Path, session: str, history: History, note: str) -> None:
    """Write the picture of the deflected boom at instants of a session."""
    most_lines = 24
    with picture(path, f"{session}: deflected boom through the session", note) as figure:
        axes = figure.add_subplot()
        side_view(axes)
        colours = colours_of_times(figure, axes, history.stamps_s, TIME)
        chosen = [history.shapes[k] for k in spread(len(history.shapes), most_lines)]
        for stamp, line in chosen[1:-1]:
            axes.plot(*line.T, color=colours(stamp), linewidth=1.4)
        _, tip = broken(history.stamps_s, history.tip_position, history.gaps)
        axes.plot(*tip.T, color=ORANGE, linewidth=1.2, label="tip trace")
        for (stamp, line), colour, name in zip(chosen[:1] + chosen[-1:], (GREEN, INK), ("first", "last"), strict=False):
            axes.plot(*line.T, color=colour, linewidth=3.2, label=f"{name}, at {stamp:.1f} s")
            axes.plot(*line[-1], "o", color=colour, markersize=8)
        for number, middle in enumerate(history.section_middles if chosen else (), 1):
            _name_section(axes, chosen[-1][1], middle, number)
        draw_base(axes, chosen[0][1][0] if chosen else np.zeros(2), 0.45)
        axes.margins(0.06)
        axes.legend(loc="upper right")


def _name_section(axes: Axes, line: Array, middle: int, number: int) -> None:
    from matplotlib.patheffects import withStroke

    (x, y), along = line[middle], line[min(middle + 1, len(line) - 1)] - line[max(middle - 1, 0)]
    across = np.array([along[1], -along[0]]) / max(float(np.hypot(*along)), 1e-9)
    axes.annotate(
        f"section {number}", (x, y), tuple(across * [42, 16]), textcoords="offset points", ha="center", va="center",
        fontsize=12, color=INK, zorder=10, path_effects=[withStroke(linewidth=3.0, foreground="white")],
    )  # fmt: skip


def spread(count: int, most: int) -> list[int]:
    """Return at most `most` of `count` indices, evenly spaced, with the first and the last."""
    return sorted({round(place) for place in np.linspace(0, count - 1, min(count, most))}) if count else []
