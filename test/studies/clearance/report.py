"""Report of the study of play in the pins."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from boom_twin import Scene
from boom_twin.scene.schema import IDEAL_BELOW
from boom_twin.system.files import write_atomic
from boom_twin.validation.study.report import page, table

from .pictures import RestOffsetCurve, Trace, sinking_picture, swing_picture
from .rest_stop_cost import BRAKE, COUNT, HOLD, MODELS, QUICK_COUNT, QUICK_HOLD, Cost, Shift, Swing, costs, shifts, swings
from .scenes import pins_of, with_play

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
