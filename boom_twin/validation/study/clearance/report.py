"""The report of the study of clearance, as Markdown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..scene.parts import IDEAL_BELOW, Scene
from . import clearance_convergence as near
from .clearance_convergence import MEASURES, Convergence, Line
from .clearance_cost import HARD_BRAKE, RAMP, STOP, VIOLENT, Cost
from .clearance_scenes import pins_of
from .clearance_static import Shift
from .clearance_stop import BRAKE, HOLD, SETTLED, Swing
from .report import provenance, table

STOP_HEAD = ("posture", "pins", "rest, mm", "peak, mm", "rms, mm", "peak acc., m/s²", "rms acc., m/s²", "halved after, s",
             "frequency, Hz", "contacts lost")  # fmt: skip


def report(scene: Scene, swings: list[Swing], shifts: list[Shift], found: Convergence, costs: list[Cost]) -> str:
    """All sections."""
    block = pins_of(scene)
    told = ", ".join(f"{pin.at} {1e6 * pin.radial_clearance:g} um" for pin in block.pins)
    head = [
        "# Play in the pins\n",
        f"Radial clearance: {told}; {block.contact.law}, exponent {block.contact.exponent:g}, restitution "
        f"{block.contact.restitution:g}, friction {block.contact.friction:g}. Radii and clearances of the "
        "package's block are "
        "surrogates.\n",
    ]
    parts = [_stops(swings), _rests(shifts), _convergence(found), _costs(costs)]
    return "\n".join([*head, *(line for part in parts for line in part), provenance()])


def _stops(found: list[Swing]) -> list[str]:
    rows = [
        (own.posture, own.model, 1e3 * own.rest, 1e3 * own.peak, 1e3 * own.rms, own.top, own.effective,
         own.settling if np.isfinite(own.settling) else "not seen", own.frequency, own.lost)
        for own in found
    ]  # fmt: skip
    return [
        "## After a stop\n",
        "![The tip after a stop](clearance.png)\n",
        "From rest in each posture the cylinders of the study's motion run at full speed (the whole stroke in 10 s, or as "
        f"fast as the motion's travel allows), brake within {1e3 * BRAKE:g} ms, and hold for up to {HOLD:g} s. "
        "Vertical movement "
        "of the tip, step 1 ms. Rest: where the tip comes to lie, against ideal pins. Peak and rms: distance "
        "from that rest "
        "after the stop (linearised pins: from the mean). Halved: stays "
        f"within {SETTLED:g} of the peak from then on. Contacts lost are those seen from row to row; of "
        "linearised pins, which pull as well, "
        "those that contact would have lost.\n",
        table(STOP_HEAD, rows),
    ]


def _rests(found: list[Shift]) -> list[str]:
    first = found[0].clearances
    shown = [int(np.argmin(np.abs(first - c))) for c in (1e-3, 1e-4, 1e-5)]
    head = ("posture", "pin", "lever, m/m", "loaded", *(f"{1e6 * first[k]:.3g} um" for k in shown),
            f"jump at {1e6 * IDEAL_BELOW:g} um", "force, N", "ratio")  # fmt: skip
    rows = [
        (own.posture, own.pin, own.lever, own.loaded, *(1e3 * float(own.shifts[k]) for k in shown), 1e3 * own.jump, own.force,
         f"{own.ratios.min():.4f} to {own.ratios.max():.4f}")
        for own in found
    ]  # fmt: skip
    worst = max(found, key=lambda own: own.jump)
    return [
        "## At rest\n",
        "![The resting tip](clearance_static.png)\n",
        "Distance (mm) of the resting tip from that with ideal pins, with play in one pin only. Lever: way of the tip for "
        "the way of the cylinder, of the rigid boom's geometry; loaded: of the elastic boom under its "
        "weight, by moving the "
        "stroke. Ratio: the shift over loaded lever x (clearance + penetration), least and greatest over all "
        "clearances. Below "
        f"{1e6 * IDEAL_BELOW:g} um a pin is ideal; the tip then jumps by what the column says, at worst "
        f"{1e3 * worst.jump:.3g} mm ({worst.pin}, {worst.posture}): mostly penetration, which the cap on the "
        "contact's stiffness "
        "leaves when the clearance is gone.\n",
        table(head, rows),
    ]


def _convergence(found: Convergence) -> list[str]:
    lines = [
        "## Convergence\n",
        "![Error against run time](clearance_convergence.png)\n",
        f"A stop within {1e3 * near.BRAKE:g} ms out of full speed, {found.span:g} s in all, rows every "
        f"{1e3 * near.ROW:g} ms; "
        "errors are rms over the rows, of acceleration and force as a share of their own rms. Own reference: "
        "boom_twin with steps of "
        f"{1e6 * near.FINEST:g} us. Independent: the rigid boom on one compliant cylinder, Lagrange's equations by hand in "
        "three coordinates, integrated by SciPy's LSODA between touch and release (`boom_twin/peers/play`), tolerance "
        f"{near.TIGHTEST:g}. It shares no equation with boom_twin but states the same contact law.\n",
    ]
    if np.isfinite(found.apart).all():
        lines.append(
            f"Both references of the one pin differ by {found.apart[0]:.2g} mm, {found.apart[1]:.2g} % of the "
            "acceleration and "
            f"{found.apart[2]:.2g} % of the force. Accelerations at steps below 20 us carry the round-off of "
            "positions over "
            "the square of the step: the run of 1 us is no reference for them, the independent one is.\n"
        )
    else:
        lines.append("Without the independent model: no cylinder has k, barrel and rod.\n")
    rows = [row for line in found.lines for row in _line(line)]
    orders = [
        (line.case, line.against, name, *(f"{order:.2f}" if np.isfinite(order) else None for order in line.orders(among)))
        for line in found.lines
        if line.program == "boom_twin"
        for name, among in (("2 to 0.2 ms", near.COARSE), ("100 to 10 us", near.FINE))
    ]
    return [
        *lines,
        table(("boom", "reference", "steps", *(f"order, {name.split(',')[0]}" for name in MEASURES)), orders),
        table(("boom", "program", "reference", "step or tolerance", *MEASURES, "run time, s"), rows),
    ]


def _line(line: Line) -> list[Sequence[object]]:
    unit = (1e3, "ms") if line.program == "boom_twin" else (1.0, "")
    marks = [f"{unit[0] * mark:g} {unit[1]}".strip() for mark in line.marks]
    rows = zip(marks, line.errors.tolist(), line.seconds, strict=True)
    return [(line.case, line.program, line.against, mark, *errors, seconds) for mark, errors, seconds in rows]


def _costs(found: list[Cost]) -> list[str]:
    rows = [(own.pins, own.treatment, 1e6 * own.gentle, own.factors[0], 1e6 * own.violent, own.factors[1]) for own in found]
    return [
        "## What a pin costs\n",
        f"Step 1 ms. Gentle: the move of the other studies. Violent: to full speed within {1e3 * RAMP:g} ms, after "
        f"{1e3 * STOP:g} ms to a stop within {1e3 * HARD_BRAKE:g} ms, {VIOLENT:g} s in all. Least of several runs. "
        "Factor: real time "
        "over run time.\n",
        table(("pins", "treatment", "gentle, us a step", "factor", "violent, us a step", "factor"), rows),
    ]
