"""Play in the pins: after a stop, at rest, convergence, cost: `boom_twin study clearance`."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.march import march
from ..errors import UsageError
from ..io.atomic import write_atomic
from ..plan.compile import compile_scene
from ..scene.parts import IDEAL_BELOW, Scene
from ..view.clearance import Sinking, Trace, sinking_picture, swing_picture
from ..view.orbits import orbits_picture
from ..view.records import Orbits
from ..view.work_precision import Curve, Panel, work_precision_picture
from .clearance_convergence import MEASURES, Convergence, Line, convergence
from .clearance_cost import STEP, VIOLENT, Cost, costs, violent
from .clearance_report import report
from .clearance_scenes import treated, with_play
from .clearance_static import COUNT, QUICK_COUNT, Shift, shifts
from .clearance_stop import HOLD, QUICK_HOLD, Swing, swings
from .report import machine, write_json

NOTE = "surrogate parameters; computed, not measured on a rig"
SHOWN = 3.0  # s after the stop
FAMILIES = {
    ("all rods' pins, elastic boom", "boom_twin"): "elastic",
    ("one pin, rigid boom", "boom_twin"): "play",
    ("one pin, rigid boom", "SciPy"): "events",
}


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
    sinking = [Sinking(own.posture, own.pin, own.clearances, own.shifts) for own in found.shifts]
    sinking_picture(paths[3], "The resting tip with play in the pin of one rod", NOTE, sinking, IDEAL_BELOW)
    work_precision_picture(paths[4], "Motions with play: error against run time", NOTE, panels(found.convergence))
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


def panels(found: Convergence) -> tuple[Panel, ...]:
    """A panel a measure; the boom with one pin against the independent model where there is one."""
    chosen = [line for line in found.lines if line.against == "independent" or line.case.startswith("all")]
    curves = [tuple(_curve(found, line, k) for line in chosen) for k in range(len(MEASURES))]
    return tuple(Panel(name.split(",")[0], name, own) for name, own in zip(MEASURES, curves, strict=True))


def _curve(found: Convergence, line: Line, measure: int) -> Curve:
    family = FAMILIES[line.case, line.program]
    notes = [f"{1e3 * mark:g} ms" if line.program == "boom_twin" else f"{mark:.0e}" for mark in line.marks]
    some = tuple(note if number % 3 == 1 else "" for number, note in enumerate(notes))
    seconds = tuple(second / found.span for second in line.seconds)
    return Curve(line.case, family, seconds, tuple(line.errors[:, measure].tolist()), some)


def _orbits(path: Path, scene: Scene, posture: str | None) -> None:
    """Of the violent stop that the costs are measured in."""
    contact, drive = treated(scene, "contact"), violent(scene, posture)
    moved, plan = march(contact, drive, VIOLENT, STEP, angles=drive.angles), compile_scene(contact)
    lost = np.sum(np.diff(moved.pins[:, :, 3], axis=0) < 0.0, axis=0)
    orbits = Orbits(moved.times, plan.pins, plan.tables.clearances.gap, moved.pins, lost)
    orbits_picture(path, "Journals in their bushes: a violent start and stop", orbits, NOTE)
