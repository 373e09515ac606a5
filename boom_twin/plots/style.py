"""Common style of all pictures: canvas, colours, titles, base and pins, PNG files. No display is needed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import UsageError
from ..system.files import write_atomic
from ..system.terminal_text import printable
from ..types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .history import AlarmSpan


# after Okabe and Ito: distinguishable with every kind of colour vision
BLUE, ORANGE, GREEN, PURPLE, SKY = "#0072B2", "#D55E00", "#009E73", "#AA4499", "#56B4E9"
INK, GREY, PALE = "#222222", "#8A8A8A", "#DDDDDD"
TONES = ((BLUE, "o"), (ORANGE, "s"), (GREEN, "D"), (PURPLE, "^"), (SKY, "v"), (INK, "P"))
"""Colour and marker of each curve in a group."""
DPI = 100
MARGIN = 0.08  # fraction of the data range, left free above and below
TIME = "time since first sample, s"  # label of time axes
NOTE = 70  # longest note beside a title, characters

LOOK = {
    "font.size": 13,
    "axes.titlesize": 13,
    "axes.titlelocation": "left",
    "axes.labelsize": 13,
    "axes.labelcolor": INK,
    "axes.edgecolor": GREY,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E8E8E8",
    "grid.linewidth": 0.8,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 12,
    "ytick.labelsize": 12,
    "legend.frameon": False,
    "legend.fontsize": 12,
    "lines.linewidth": 1.3,
    "agg.path.chunksize": 20000,
    "figure.subplot.left": 0.06,
    "figure.subplot.right": 0.99,
    "date.converter": "concise",
}


LARGE: dict[str, Any] = {"fontsize": 17, "color": INK, "va": "top", "ha": "left", "weight": "bold", "parse_math": False}
SMALL: dict[str, Any] = {"fontsize": 13, "color": GREY, "va": "top", "ha": "right", "style": "italic", "parse_math": False}


def import_plotting() -> Any:
    """Import matplotlib, which takes long; return it, its canvas without a display, and its figure."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    return matplotlib, FigureCanvasAgg, Figure


@contextmanager
def picture(path: Path, title: str, note: str = "", size: tuple[float, float] = (16.0, 9.0)) -> Iterator[Figure]:
    """Provide a titled figure of `size` (hundreds of pixels), and write it to `path` as PNG at the end of the block.

    Equal arrays give equal bytes: the file contains no time and no version. UsageError if `path` does not end with .png.
    """
    matplotlib, FigureCanvasAgg, Figure = import_plotting()
    if path.suffix.lower() != ".png":
        raise UsageError(f"{path}: a picture is a PNG file. Give a name that ends with .png.")
    with matplotlib.rc_context({**matplotlib.rcParamsDefault, **LOOK}):
        figure = Figure(figsize=size, dpi=DPI, layout="constrained")
        canvas = FigureCanvasAgg(figure)
        top = 1.0 - 0.52 / size[1]
        figure.get_layout_engine().set(rect=(0.0, 0.0, 1.0, top), w_pad=0.1, h_pad=0.07)
        figure.text(0.012, 1.0 - 0.14 / size[1], printable(title, ""), **LARGE)
        if note:
            figure.text(0.988, 1.0 - 0.16 / size[1], shorten(printable(note), NOTE, placeholder=" .."), **SMALL)
        yield figure
        _part_titles_and_legends(figure)
        for spine in (each for axes in figure.axes for each in axes.spines.values()):
            spine.set_in_layout(False)  # each would make all ticks anew, and none is outside of the tick labels
        content = BytesIO()
        # `savefig` draws everything twice, the first time for its layout
        canvas.print_png(content, metadata={"Software": None}, pil_kwargs={"compress_level": 3})
    write_atomic(path, content.getvalue())


def _part_titles_and_legends(figure: Any) -> None:
    """Raise every title that a legend would cover above that legend, by the widths before the layout."""
    from matplotlib.text import Text

    for axes in figure.axes:
        legend, text = axes.get_legend(), axes.get_title(loc="left")
        texts = [each for each in axes.get_children() if isinstance(each, Text)] if legend and text else []
        for title in (each for each in texts if each.get_text() == text):
            box = legend.get_window_extent()
            if box.overlaps(title.get_window_extent()):
                axes.set_title(text, loc="left", pad=6.0 + 72.0 / DPI * (box.y1 - axes.get_window_extent().y1))


def shade_gaps(axes: Axes, gaps: list[tuple[float, float]]) -> None:
    """Draw grey bands where samples were missing. The first band has a legend label."""
    for number, (start, stop) in enumerate(gaps):
        axes.axvspan(start, stop, color=PALE, linewidth=0, zorder=0.5, label="" if number else "no samples")


def shade_alarms(axes: Axes, alarms: list[AlarmSpan]) -> None:
    """Draw a coloured band for the duration of each alarm, with its label."""
    for alarm in alarms:
        axes.axvspan(alarm.start, alarm.stop, color=ORANGE, alpha=0.13, linewidth=0, zorder=0.4)
        place = (max(alarm.start, axes.get_xlim()[0]), 0.97)
        axes.annotate(
            alarm.label, place, xycoords=axes.get_xaxis_transform(), xytext=(4, 0), textcoords="offset points",
            va="top", fontsize=11, color=ORANGE, weight="bold",
        )  # fmt: skip


def broken(stamps: Array, values: Array, gaps: list[tuple[float, float]]) -> tuple[Array, Array]:
    """Return `stamps` (m,) and `values` (m, c) with a NaN row in the middle of every gap, to interrupt lines there."""
    middles = np.array([0.5 * (start + stop) for start, stop in gaps])
    places = np.searchsorted(stamps, middles)
    return np.insert(stamps, places, middles), np.insert(values, places, np.nan, axis=0)


def extent(times: Array) -> tuple[float, float]:
    """Return axis limits: the first and last of `times` (k,), at least a millisecond apart."""
    return float(times[0]), float(max(times[-1], times[0] + 1e-3))


def side_view(axes: Axes) -> None:
    """Set equal scales and the labels of a side view of the boom."""
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x forward, m")
    axes.set_ylabel("y up, m")


def draw_base(axes: Axes, pivot: Array, size: float) -> None:
    """Draw a triangle under a pivot (m) on hatched ground; `size` is its height (m)."""
    x, y = pivot
    ground, half = y - size, 0.6 * size
    axes.fill([x - half, x, x + half], [ground, y, ground], facecolor="white", edgecolor=INK, zorder=1.5)
    axes.plot([x - size, x + size], [ground, ground], color=INK, zorder=1.5)
    for k in np.linspace(-0.85, 1.0, 7):
        dash = [x + k * size, x + (k - 0.25) * size]
        axes.plot(dash, [ground, ground - 0.25 * size], color=INK, linewidth=0.9, zorder=1.5)
    draw_pin(axes, pivot)


def draw_pin(axes: Axes, place: Array, size: float = 6.0, colour: str = INK) -> None:
    """Draw a pin as a small circle, `size` in points."""
    look: dict[str, Any] = {"markerfacecolor": "white", "markeredgecolor": colour, "markeredgewidth": 1.5}
    axes.plot(place[0], place[1], "o", markersize=size, zorder=8, **look)


def colours_of_times(figure: Figure, axes: Any, times: Array, label: str) -> Callable[[Any], Any]:
    """Draw a colour bar of `times` (k,), s, beside `axes`; return the function from times to colours."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    colours = LinearSegmentedColormap.from_list("time", ["#D6E6F2", "#5A9BCB", "#08306B"])
    mapping = ScalarMappable(Normalize(*extent(times)), colours)
    bar = figure.colorbar(mapping, ax=axes, label=label, shrink=0.7, pad=0.01)
    bar.outline.set_edgecolor(GREY)
    return mapping.to_rgba


def legend_above(axes: Axes, columns: int = 1, top: float = 1.0, **look: Any) -> None:
    """Draw a legend, if anything has a label, above the right end of `axes`; `top` is its lower edge over the axes' height."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, top), ncols=columns, borderaxespad=0.1, **look)


def limits(*arrays: Array, around: float | None = None) -> tuple[float, float]:
    """Return axis limits with a margin around all finite values, symmetric about `around` if given."""
    values = np.concatenate([np.ravel(array) for array in arrays])
    values = values[np.isfinite(values)]
    if values.size == 0:
        return -1.0, 1.0
    low, high = float(values.min()), float(values.max())
    if around is not None:
        reach = max(high - around, around - low)
        low, high = around - reach, around + reach
    margin = MARGIN * (high - low) or 1.0
    return low - margin, high + margin
