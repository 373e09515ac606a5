"""Report of the study of play in the pins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from boom_twin.analysis.methods import integrate_with
from boom_twin.compiler.compile import compile_scene
from boom_twin.errors import UsageError
from boom_twin.plots.history import Orbits
from boom_twin.plots.posture import orbits_picture
from boom_twin.scene.schema import IDEAL_BELOW, Scene
from boom_twin.system.atomic_files import write_atomic
from boom_twin.validation.study.report import machine, provenance, table, write_json

from . import convergence as near
from .convergence import MEASURES, Convergence, ErrorCurve, convergence
from .pictures import RestOffsetCurve, Trace, convergence_picture, sinking_picture, swing_picture
from .rest_stop_cost import (
    BRAKE,
    COUNT,
    HARD_BRAKE,
    HOLD,
    QUICK_COUNT,
    QUICK_HOLD,
    RAMP,
    SETTLED,
    STEP,
    STOP,
    VIOLENT,
    Cost,
    Shift,
    Swing,
    costs,
    hard_stop,
    shifts,
    swings,
)
from .scenes import pins_of, treated, with_play

STOP_HEAD = ("posture", "pins", "rest, mm", "peak, mm", "rms, mm", "peak acc., m/s²", "rms acc., m/s²", "halved after, s",
             "frequency, Hz", "contacts lost")  # fmt: skip


def report(scene: Scene, swings: list[Swing], shifts: list[Shift], found: Convergence, costs: list[Cost]) -> str:
    """All sections."""
    block = pins_of(scene)
    told = ", ".join(f"{pin.at} {1e6 * pin.radial_clearance:g} um" for pin in block.pins)
    head = [
        "# Play in the pins\n",
        f"Radial clearance: {told}; {block.contact.law}, exponent {block.contact.exponent:g}, restitution "
        f"{block.contact.restitution:g}, friction {block.contact.friction:g}. Radii and clearances of the package's block are "
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
        f"fast as the motion's travel allows), brake within {1e3 * BRAKE:g} ms, and hold for up to {HOLD:g} s. Vertical "
        "movement of the tip, step 1 ms. Rest: where the tip comes to lie, against ideal pins. Peak and rms: distance from "
        f"that rest after the stop (linearised pins: from the mean). Halved: stays within {SETTLED:g} of the peak from then "
        "on. Contacts lost are those seen from row to row; of linearised pins, which pull as well, those that contact would "
        "have lost.\n",
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
        "the way of the cylinder, of the rigid boom's geometry; loaded: of the elastic boom under its weight, by moving the "
        "stroke. Ratio: the shift over loaded lever x (clearance + penetration), least and greatest over all clearances. "
        f"Below {1e6 * IDEAL_BELOW:g} um a pin is ideal; the tip then jumps by what the column says, at worst "
        f"{1e3 * worst.jump:.3g} mm ({worst.pin}, {worst.posture}): mostly penetration, which the cap on the contact's "
        "stiffness leaves when the clearance is gone.\n",
        table(head, rows),
    ]


def _convergence(found: Convergence) -> list[str]:
    lines = [
        "## Convergence\n",
        "![Error against run time](clearance_convergence.png)\n",
        f"A stop within {1e3 * near.BRAKE:g} ms out of full speed, {found.span:g} s in all, rows every {1e3 * near.ROW:g} ms; "
        "errors are rms over the rows, of acceleration and force as a share of their own rms. Own reference: boom_twin with "
        f"steps of {1e6 * near.FINEST:g} us. Independent: the rigid boom on one compliant cylinder, Lagrange's equations by "
        "hand in three coordinates, integrated by SciPy's LSODA between touch and release "
        f"(`test/reference/worn_pin`), tolerance {near.TIGHTEST:g}. It shares no equation with boom_twin but "
        "states the same contact law.\n",
    ]
    if np.isfinite(found.apart).all():
        lines.append(
            f"Both references of the one pin differ by {found.apart[0]:.2g} mm, {found.apart[1]:.2g} % of the acceleration "
            f"and {found.apart[2]:.2g} % of the force. Accelerations at steps below 20 us carry the round-off of positions "
            "over the square of the step: the run of 1 us is no reference for them, the independent one is.\n"
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


def _line(line: ErrorCurve) -> list[Sequence[object]]:
    unit = (1e3, "ms") if line.program == "boom_twin" else (1.0, "")
    marks = [f"{unit[0] * mark:g} {unit[1]}".strip() for mark in line.marks]
    rows = zip(marks, line.errors.tolist(), line.seconds, strict=True)
    return [(line.case, line.program, line.against, mark, *errors, seconds) for mark, errors, seconds in rows]


def _costs(found: list[Cost]) -> list[str]:
    rows = [(own.pins, own.treatment, 1e6 * own.gentle, own.factors[0], 1e6 * own.violent, own.factors[1]) for own in found]
    return [
        "## What a pin costs\n",
        f"Step 1 ms. Gentle: the move of the other studies. Violent: to full speed within {1e3 * RAMP:g} ms, after "
        f"{1e3 * STOP:g} ms to a stop within {1e3 * HARD_BRAKE:g} ms, {VIOLENT:g} s in all. Least of several runs. Factor: "
        "real time over run time.\n",
        table(("pins", "treatment", "gentle, us a step", "factor", "violent, us a step", "factor"), rows),
    ]


NOTE = "surrogate parameters; computed, not measured on a rig"
SHOWN = 3.0  # s after the stop


@dataclass(frozen=True)
class Study:
    """All that is reported."""

    swings: list[Swing]
    shifts: list[Shift]
    convergence: Convergence
    costs: list[Cost]


def write(scene: Scene, out: Path, quick: bool = False, posture: str | None = None) -> list[Path]:
    """Measure, and write ``clearance.json``, ``clearance.md`` and pictures into `out`; returns their paths.

    The pins are those of the scene, or else the package's. Stops and rests are in all postures of the scene, convergence and
    cost from `posture`.

    Raises
    ------
    UsageError
        The scene has no posture.
    """
    if not scene.postures:
        raise UsageError("postures: the scene has none, and the study starts from them. Add one.")
    scene, postures = with_play(scene), tuple(scene.postures)
    found = Study(
        swings(scene, postures, QUICK_HOLD if quick else HOLD),
        shifts(scene, postures, QUICK_COUNT if quick else COUNT),
        convergence(scene, posture, quick),
        costs(scene, posture, quick),
    )
    out.mkdir(parents=True, exist_ok=True)
    paths = [out / f"clearance{part}" for part in (".json", ".md", ".png", "_static.png", "_convergence.png", "_orbits.png")]
    write_json(paths[0], {"machine": machine(), **as_json(found)})
    text = report(scene, found.swings, found.shifts, found.convergence, found.costs)
    write_atomic(paths[1], text)
    traces = [Trace(own.posture, own.model, own.times, own.height, own.acceleration) for own in found.swings]
    swing_picture(paths[2], "The tip after a stop: ideal pins, contact, linearised pins", NOTE, traces, SHOWN)
    sinking = [RestOffsetCurve(own.posture, own.pin, own.clearances, own.shifts) for own in found.shifts]
    sinking_picture(paths[3], "The resting tip with play in the pin of one rod", NOTE, sinking, IDEAL_BELOW)
    convergence_picture(paths[4], "Motions with play: error against run time", NOTE, found.convergence)
    _orbits(paths[5], scene, posture)
    return paths


def as_json(found: Study) -> dict[str, Any]:
    """All numbers but the traces, SI units."""
    traces = ("times", "height", "acceleration")
    return {
        "stops": [{key: value for key, value in asdict(own).items() if key not in traces} for own in found.swings],
        "rests": [asdict(own) | {"jump": own.jump, "ratios": own.ratios} for own in found.shifts],
        "convergence": {"span_s": found.convergence.span, "lines": [asdict(line) for line in found.convergence.lines]},
        "references_differ": dict(zip(MEASURES, found.convergence.apart, strict=True)),
        "costs": [asdict(own) for own in found.costs],
    }


def _orbits(path: Path, scene: Scene, posture: str | None) -> None:
    """Write a picture of the journals' orbits in the violent stop that the costs are measured in."""
    contact, drive = treated(scene, "contact"), hard_stop(scene, posture)
    moved, plan = integrate_with(contact, drive, VIOLENT, STEP, angles=drive.angles), compile_scene(contact)
    lost = np.sum(np.diff(moved.pins[:, :, 3], axis=0) < 0.0, axis=0)
    orbits = Orbits(moved.times, plan.pins, plan.tables.clearances.gap, moved.pins, lost)
    orbits_picture(path, "Journals in their bushes: a violent start and stop", orbits, NOTE)
