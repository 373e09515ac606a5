"""Report of the study of play in the pins."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from boom_twin import Scene
from boom_twin.plots.style import BLUE, GREY, INK, ORANGE, TONES, picture
from boom_twin.scene.schema import IDEAL_BELOW
from boom_twin.system.files import write_atomic
from boom_twin.validation.study.report import page, table

from .rest_stop_cost import BRAKE, COUNT, HOLD, MODELS, QUICK_COUNT, QUICK_HOLD, Cost, Shift, Swing, costs, shifts, swings
from .scenes import pins_of, with_play

if TYPE_CHECKING:
    from matplotlib.axes import Axes


BEFORE = 0.2  # s that are shown before a stop
LOOKS = {"ideal": (GREY, 2.4), "contact": (ORANGE, 1.3), "spring-damper": (BLUE, 1.0)}


@dataclass(frozen=True)
class Trace:
    """Tip in one posture with one kind of pins (a key of `LOOKS`): s, vertical displacement m, acceleration m/s^2."""

    posture: str
    model: str
    times: np.ndarray
    height: np.ndarray
    acceleration: np.ndarray


def swing_picture(path: Path, title: str, note: str, traces: list[Trace], until: float) -> None:
    """Write a column a posture: vertical displacement above, acceleration below, up to `until` s after the stop."""
    postures = list(dict.fromkeys(trace.posture for trace in traces))
    with picture(path, title, note, (5.0 * max(len(postures), 2), 8.6)) as figure:
        grid = figure.subplots(2, len(postures), squeeze=False, sharex=True)
        for column, posture in enumerate(postures):
            for trace in (own for own in traces if own.posture == posture):
                colour, width = LOOKS[trace.model]
                shown = (trace.times >= -BEFORE) & (trace.times <= until)
                for axes, values in zip(grid[:, column], (1e3 * trace.height, trace.acceleration), strict=True):
                    axes.plot(trace.times[shown], values[shown], color=colour, linewidth=width, label=trace.model)
            grid[0, column].set_title(posture)
            grid[1, column].set_xlabel("time after the stop, s")
        grid[0, 0].set_ylabel("height of the tip, mm\n(0: rest with ideal pins)")
        grid[1, 0].set_ylabel("vertical acceleration, m/s²")
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)


@dataclass(frozen=True)
class RestOffsetCurve:
    """Distance (m) of the resting tip from that with ideal pins over clearances (m), both (k,), for one pin in a posture."""

    posture: str
    pin: str
    clearances: np.ndarray
    shifts: np.ndarray


def sinking_picture(path: Path, title: str, note: str, found: list[RestOffsetCurve], switch: float) -> None:
    """Write a panel a posture; below `switch` (m) a pin is ideal."""
    postures = list(dict.fromkeys(own.posture for own in found))
    with picture(path, title, note, (4.6 * max(len(postures), 2), 6.4)) as figure:
        grid = figure.subplots(1, len(postures), squeeze=False, sharex=True, sharey=True)[0]
        for axes, posture in zip(grid, postures, strict=True):
            for number, own in enumerate(one for one in found if one.posture == posture):
                colour, marker = TONES[number % len(TONES)]
                axes.loglog(1e6 * own.clearances, 1e3 * own.shifts, color=colour, marker=marker, markersize=4, label=own.pin)
                axes.plot([0.5e6 * switch], [1e3 * own.shifts[-1]], "<", color=colour, markersize=6)
            _switch(axes, switch)
            axes.set_title(posture)
            axes.set_xlabel("radial clearance, µm")
        grid[0].set_ylabel("shift of the resting tip, mm")
        figure.legend(*grid[0].get_legend_handles_labels(), loc="outside lower center", ncols=6)


def _switch(axes: Axes, switch: float) -> None:
    axes.axvline(1e6 * switch, color=INK, linewidth=1.0, linestyle="--")
    axes.text(1.1e6 * switch, 0.97, "ideal below", transform=axes.get_xaxis_transform(), va="top", fontsize=11, color=INK)
    axes.set_xlim(left=0.4e6 * switch)
    axes.set_xticks(np.geomspace(1.0, 1000.0, 4), ["1", "10", "100", "1000"])


PINS = ("ideal", "contact", "linear")
SHOWN_CLEARANCE = 1e-4  # m, of the table of rests


def report(scene: Scene, swings: list[Swing], shifts: list[Shift], costs: list[Cost]) -> str:
    """Return all sections."""
    block = pins_of(scene)
    sizes = ", ".join(f"{1e6 * size:g}" for size in sorted({pin.radial_clearance for pin in block.pins}))
    parts = [
        "# Play in the pins",
        f"{len(block.pins)} pins have a radial clearance of {sizes} um. Contact law: {block.contact.law}, restitution "
        f"{block.contact.restitution:g}.",
        *_stops(swings), *_rests(shifts), *_costs(costs),
        "Limits: one motion per posture.",
    ]  # fmt: skip
    return page(parts)


def _stops(found: list[Swing]) -> list[str]:
    by = {(own.posture, own.model): own for own in found}
    rows = []
    for posture in dict.fromkeys(own.posture for own in found):
        each = [by[posture, model] for model in MODELS]
        rows.append((posture, 1e3 * each[1].rest, *(1e3 * own.peak for own in each), *(own.effective for own in each)))
    return [
        "## After a stop",
        "![The tip after a stop](clearance.png)",
        f"The drives brake from full speed within {1e3 * BRAKE:g} ms. Rest: tip height with contact minus that with ideal "
        "pins. Peak: largest distance from rest, mm. m/s²: rms vertical acceleration. Linear: pins are springs and dampers.",
        table(("posture", "rest, mm", *(f"peak, {name}" for name in PINS), *(f"m/s², {name}" for name in PINS)), rows),
    ]


def _rests(found: list[Shift]) -> list[str]:
    postures = tuple(dict.fromkeys(own.posture for own in found))
    at = {(own.pin, own.posture): 1e3 * float(own.shifts[np.argmin(np.abs(own.clearances - SHOWN_CLEARANCE))]) for own in found}
    rows = [(pin, *(at[pin, posture] for posture in postures)) for pin in dict.fromkeys(own.pin for own in found)]
    ratios = np.concatenate([own.ratios for own in found])
    worst = max(found, key=lambda own: own.jump)
    return [
        "## At rest",
        "![The resting tip](clearance_static.png)",
        f"Shift of the resting tip (mm) by play of {1e6 * SHOWN_CLEARANCE:g} um in one pin. It is lever x (clearance + "
        f"penetration) x {ratios.min():.3f} to {ratios.max():.3f}. Pins below {1e6 * IDEAL_BELOW:g} um are ideal. There the "
        f"tip jumps by up to {1e3 * worst.jump:.3g} mm ({worst.pin}, {worst.posture}).",
        table(("pin", *postures), rows),
    ]


def _costs(found: list[Cost]) -> list[str]:
    by = {(own.pins, own.treatment): (1e6 * own.gentle, 1e6 * own.violent) for own in found}
    counts = sorted({pins for pins, _ in by if pins})
    rows = [(0, *by[0, "ideal"], None, None)]
    rows += [(pins, *by[pins, "contact"], *by[pins, "spring-damper"]) for pins in counts]
    return [
        "## What a pin costs",
        "Time of a 1 ms step, us, in the usual move and in a violent start and stop.",
        table(("pins", "contact", "contact, violent", "linear", "linear, violent"), rows),
    ]


NOTE = "surrogate parameters; computed, not measured on a rig"
SHOWN = 3.0  # s after the stop


def write(scene: Scene, out: Path, quick: bool = False) -> list[Path]:
    """Measure, and write ``clearance.md`` and pictures into `out`; returns their paths.

    The pins are those of the scene, or else the package's. Stops and rests are in all postures of the scene.
    """
    scene, postures = with_play(scene), tuple(scene.postures)
    stops, rests = (
        swings(scene, postures, QUICK_HOLD if quick else HOLD),
        shifts(scene, postures, QUICK_COUNT if quick else COUNT),
    )
    paths = [out / f"clearance{part}" for part in (".md", ".png", "_static.png")]
    write_atomic(paths[0], report(scene, stops, rests, costs(scene, quick)))
    traces = [Trace(own.posture, own.model, own.times, own.height, own.acceleration) for own in stops]
    swing_picture(paths[1], "The tip after a stop: ideal pins, contact, linearised pins", NOTE, traces, SHOWN)
    sinking = [RestOffsetCurve(own.posture, own.pin, own.clearances, own.shifts) for own in rests]
    sinking_picture(paths[2], "The resting tip with play in the pin of one rod", NOTE, sinking, IDEAL_BELOW)
    return paths
