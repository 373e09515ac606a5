"""Report of the study of the papers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from studies.clearance.scenes import ideal

from boom_twin.analysis.equilibrium import settle, statics
from boom_twin.analysis.initial_state import undeflected
from boom_twin.analysis.modal import damping_ratio, natural_modes
from boom_twin.analysis.motions import motion_of
from boom_twin.analysis.simulate import simulate
from boom_twin.compiler.compile import BasisName, compile_scene
from boom_twin.errors import UsageError
from boom_twin.scene.kinematics import posture_angles, skeleton, strokes_of_posture
from boom_twin.scene.schema import Scene
from boom_twin.system.atomic_files import write_atomic
from boom_twin.types import Array
from boom_twin.validation.study.report import machine, provenance, table, write_json

from .boundary_zeros import BoundaryZero, equilibrium, frequencies
from .items import ITEMS
from .low_speed import error_by_speed
from .pictures import LetGoTrace, StopTrace, low_speed_picture, posture_picture
from .postures import PEER_STEPS, Comparison, PostureRun, compare, run_own, run_peer
from .sweep_matrices import boundary_solution, chain_of, difference

SPAN, INSTANT = 1.2, 0.5  # s: of the stops; of the reference move where matrices are made
STEPS = (1e-3, 1e-2, 0.1)  # s
RISES, QUICK_RISES = (24.0, 12.0, 6.0, 3.0, 1.5, 0.75), (6.0, 3.0)  # s
HELD = 3.0  # s, of a boom that is let go
MODES = 4
NOTE = "surrogate parameters; nothing was measured on a rig"


@dataclass(frozen=True)
class MatrixCheck:
    """One step size: difference from the sweep by substructure; error of the base force by the product, and its condition."""

    step: float
    names: tuple[str, ...]
    differences: tuple[float, ...]
    base_error: float
    condition: float


@dataclass(frozen=True)
class BasisRow:
    """One posture: sag (m) of the tip, frequencies (Hz) by default shapes and by cantilever modes, damping ratio of mode 1."""

    posture: str
    sag: float
    default: tuple[float, ...]
    cantilever: tuple[float, ...]
    damping: float


@dataclass(frozen=True)
class PapersStudy:
    """All that was computed; see the fields' classes. `speeds`: see `low_speed.error_by_speed`."""

    matrices: tuple[MatrixCheck, ...]
    zeros: tuple[BoundaryZero, ...]
    bisected: tuple[tuple[float, float], ...]
    bases: tuple[BasisRow, ...]
    speeds: Array
    let_go: tuple[LetGoTrace, ...]
    stops: tuple[Comparison, ...]


def measure(scene: Scene, postures: Sequence[str], quick: bool) -> PapersStudy:
    """Compute everything; scenes with clearance are taken with ideal pins where the papers' form knows no other."""
    bare = ideal(scene)
    stops = [
        compare(run_own(scene, posture, pins, SPAN), run_peer(scene, posture, pins, SPAN, step))
        for posture in postures
        for pins, step in PEER_STEPS.items()
    ]
    return PapersStudy(
        tuple(_matrices(bare, step) for step in STEPS),
        tuple(equilibrium(bare, posture) for posture in postures),
        tuple(frequencies(bare, postures[0], MODES)),
        tuple(_bases(bare, posture) for posture in postures),
        error_by_speed(bare, motion_of(bare), QUICK_RISES if quick else RISES),
        _let_go(bare, postures[0]),
        tuple(stops),
    )


def _matrices(scene: Scene, step: float) -> MatrixCheck:
    own, swept = chain_of(scene, INSTANT, step)
    differences = tuple(difference(one.matrix, other) for one, other in zip(own, swept, strict=True))
    first, condition = boundary_solution(own)
    right = own[0].inlet
    error = float(np.abs(first[4:] - right[4:]).max() / np.abs(right[4:]).max())
    return MatrixCheck(step, tuple(one.name for one in own), differences, error, condition)


def _bases(scene: Scene, posture: str) -> BasisRow:
    strokes, angles = strokes_of_posture(scene, posture), posture_angles(scene, posture)
    found: dict[BasisName, tuple[float, ...]] = {}
    bases: tuple[BasisName, ...] = ("cantilever", "end-shapes")
    for basis in bases:
        plan = compile_scene(scene, basis)
        state, work = plan.state(), plan.work()
        settle(plan, state, work, strokes, angles)
        modes = natural_modes(plan, state, work, MODES)
        found[basis] = tuple(mode.frequency for mode in modes)
        damping = damping_ratio(plan, modes[0])
    rest = statics(scene, posture=posture, modes=0)
    sag = float(np.hypot(*(rest.tip - rest.tip_rigid)))
    return BasisRow(posture, sag, found["end-shapes"], found["cantilever"], damping)


def _let_go(scene: Scene, posture: str) -> tuple[LetGoTrace, ...]:
    """The boom held in a posture, and moved up from it, from the undeflected posture."""
    strokes, angles = strokes_of_posture(scene, posture), posture_angles(scene, posture)
    start, move = undeflected(scene, strokes, angles=angles), motion_of(scene, posture)
    times = np.arange(0.0, HELD + 1e-9, 5e-3)
    height = float(skeleton(scene, angles).pivots[-1][1])
    found = []
    for name, drive in (("drives held", np.tile(strokes, (len(times), 1))), ("drives lift the boom", move(times)[0])):
        moved = simulate(scene, times, drive, 1e-3, angles, estimate_errors=False, start=start)
        rest = simulate(scene, np.zeros(1), drive[-1:], 1e-3, estimate_errors=False).tip[0, 1]
        found.append(LetGoTrace(name, times, 1e3 * (moved.tip[:, 1] - height), 1e3 * float(rest - height)))
    return tuple(found)


def write(scene: Scene, out: Path, quick: bool = False, posture: str | None = None) -> list[Path]:
    """Measure, and write ``papers.json``, ``papers.md`` and two pictures into the folder `out`; returns their paths.

    `posture`: only this one; `quick`: only the first, and few speeds.

    Raises
    ------
    UsageError
        The scene names no posture.
    """
    postures = [posture] if posture else list(scene.postures)[: 1 if quick else None]
    if not postures:
        raise UsageError("postures: none in this scene. Name at least one: the study starts there.")
    found = measure(scene, postures, quick)
    out.mkdir(parents=True, exist_ok=True)
    paths = [out / name for name in ("papers.json", "papers.md", "papers_postures.png", "papers_low_speed.png")]
    write_json(paths[0], {"machine": machine(), **_numbers(found)})
    write_atomic(paths[1], as_markdown(found))
    posture_picture(paths[2], "A stop in the papers' postures", NOTE, "Exudyn", [*_traces(found.stops)])
    low_speed_picture(
        paths[3], "Let go from the undeflected posture; the low-speed form", NOTE, found.speeds[:, 0], found.speeds[:, 1],
        list(found.let_go),
    )  # fmt: skip
    return paths


def _traces(stops: Sequence[Comparison]) -> list[StopTrace]:
    def trace(run: PostureRun, program: str) -> StopTrace:
        rise = 1e3 * (run.tip[:, 1] - run.tip[0, 1])
        return StopTrace(run.posture, run.pins, program, run.times, rise, run.acceleration[:, 1], 1e-3 * run.forces[:, 0])

    return [trace(run, program) for stop in stops for run, program in ((stop.own, "own"), (stop.peer, "peer"))]


def _numbers(found: PapersStudy) -> dict[str, object]:
    """All numbers but the traces, SI."""
    return {
        "matrices": found.matrices,
        "zeros": found.zeros,
        "frequencies_bisected_Hz": found.bisected,
        "bases": found.bases,
        "low_speed": {"tip_m_s": found.speeds[:, 0], "error_max_m": found.speeds[:, 1], "error_rms_m": found.speeds[:, 2]},
        "stops": [
            {
                "posture": s.own.posture,
                "pins": s.own.pins,
                "until_s": s.flight,
                "tip_rms_m": s.tip,
                "tip_rms_throughout_m": s.tip_throughout,
                "forces": s.forces,
                "acceleration": s.acceleration,
                "penetration": s.penetration,
            }
            for s in found.stops
        ],
    }


def slope(found: PapersStudy) -> float:
    """Return the slope of the low-speed form's error over the speed, in logarithms, over the two slowest moves."""
    speeds, errors = np.log(found.speeds[:2, 0]), np.log(found.speeds[:2, 1])
    return float((errors[1] - errors[0]) / (speeds[1] - speeds[0]))


def as_markdown(found: PapersStudy) -> str:
    """The report."""
    parts = [_head(), _matrices_text(found), _zeros_text(found), _bases_text(found), _low_speed_text(found), _stops_text(found)]
    return "\n".join([*(line for part in parts for line in part), provenance()])


def _head() -> list[str]:
    return [
        "# The method's papers, item by item\n",
        "[Z] Zhang et al. 2016, *Research on the rigid-flexible multibody dynamics of concrete placing boom*; [R] Ren et al. "
        "2014, "
        "doi 10.1155/2014/943847. Their rig and its data are not public, and most of their numbers are not in the text this "
        "was made "
        "from: all parameters here are surrogates, and no curve of theirs can be laid over one of ours.\n",
        table(("paper", "item", "counterpart"), ITEMS),
    ]


def _matrices_text(found: PapersStudy) -> list[str]:
    head = (
        "step, ms",
        *(f"{name}, difference" for name in found.matrices[0].names),
        "base force by the product, error",
        "condition",
    )
    rows = [(1e3 * one.step, *one.differences, one.base_error, one.condition) for one in found.matrices]
    return [
        "## 1. Element matrices, substructures, and their product\n",
        f"At {INSTANT:g} s of the reference move. Matrices of the elements in [x y theta M qx qy 1], assembled with E1, E2, "
        f"E3 (A) and eight "
        "loop unknowns (B), beside those that the sweep condenses: largest difference as a share of the largest entry, "
        "displacements and forces scaled alike. Then the papers' way: the product of all, its boundary known at base and tip, "
        "solved for the "
        "force at the base. It loses digits as the step falls; the Riccati form does not.\n",
        table(head, rows),
    ]


def _zeros_text(found: PapersStudy) -> list[str]:
    rows: list[tuple[object, ...]] = []
    for z in found.zeros:
        off = abs(z.bisected - z.newton)
        rows.append((f"{z.posture}, angle of section 1, rad", f"{z.bisected:.9f}", f"{z.newton:.9f}", off, z.halvings))
    for k, (near, counted) in enumerate(found.bisected):
        rows.append((f"mode {k + 1}, Hz", f"{near:.9f}", f"{counted:.9f}", abs(near - counted), None))
    return [
        "## 2. Zeros of the boundary by bisection\n",
        "By dichotomy, as the second paper solves its equation (20). Its tolerance of 1e-7 has no unit there; here it is the "
        "width of the interval that is left. Equilibrium: torque at the base pivot while section 1 is held, beside Newton's "
        "method. Frequencies: sign of the determinant at the base (interval 1e-7 of the frequency), beside "
        "the count of Wittrick and Williams.\n",
        table(("zero", "bisection", "Newton, count", "difference", "halvings"), rows),
    ]


def _bases_text(found: PapersStudy) -> list[str]:
    rows = []
    for row in found.bases:
        off = [100.0 * (c / d - 1.0) for c, d in zip(row.cantilever, row.default, strict=True)]
        rows.append((row.posture, 1e3 * row.sag, *row.default, *off, 100.0 * row.damping, np.log(10.0) / _decay(row)))
    head = (
        "posture", "sag of the tip, mm", *(f"f{k + 1}, Hz" for k in range(MODES)),
        *(f"cantilever f{k + 1}, %" for k in range(MODES)), "damping of mode 1, %", "down to a tenth after, s",
    )  # fmt: skip
    return [
        "## 3. Three cantilever modes a part, and how long the boom swings\n",
        "Frequencies with the default shapes, and by how much three cantilever modes a part are off: parts end in torques and "
        "shear "
        "forces, which no sum of cantilever modes has. Sag: of the tip at rest, from the undeflected posture.\n",
        table(head, rows),
    ]


def _decay(row: BasisRow) -> float:
    """Rate (1/s) at which mode 1 decays."""
    return 2.0 * float(np.pi) * row.default[0] * row.damping


def _low_speed_text(found: PapersStudy) -> list[str]:
    held = found.let_go[0]
    lowest = int(np.argmin(held.height))
    lifted = found.let_go[1]
    dip = int(np.argmin(lifted.height))
    return [
        "## 4. Low speed, and a boom that starts undeflected\n",
        "The reference move at six speeds, with and without Coriolis and centrifugal accelerations (a row of `study parts` "
        "has the usual "
        f"speed). The error grows with the square of the speed: slope {slope(found):.2f} between the two slowest.\n",
        table(("fastest tip, m/s", "largest error, mm", "rms, mm"), found.speeds * [1.0, 1e3, 1e3]),
        f"Let go from the undeflected posture with the drives held, the tip falls, freely at first, to "
        f"{held.height[lowest]:.0f} mm at "
        f"{held.times[lowest]:.2f} s and swings about its rest at {held.rest:.0f} mm. Lifted meanwhile, it first falls to "
        f"{lifted.height[dip]:.0f} mm at {lifted.times[dip]:.2f} s and then rises to {lifted.rest:.0f} mm: what the second "
        f"paper "
        "tells of its model, which starts there.\n",
        "![Tip of a boom let go; error of the low-speed form](papers_low_speed.png)\n",
    ]


def _stops_text(found: PapersStudy) -> list[str]:
    rows = [
        (s.own.posture, s.own.pins, s.flight, 1e3 * s.tip, 1e3 * s.tip_throughout, 100.0 * s.acceleration, 100.0 * s.forces,
         100.0 * s.penetration,
         float(np.abs(s.own.acceleration[:, 1]).max()))
        for s in found.stops
    ]  # fmt: skip
    head = (
        "posture", "pins", "until, s", "tip, rms mm", "tip to the end, rms mm", "acceleration, rms %", "cylinder forces, rms "
        "%", "penetration, largest %",
        "largest vertical acceleration, m/s²",
    )  # fmt: skip
    return [
        "## 5. Four postures, with and without clearance in four pins\n",
        "Full speed, then a stop within 50 ms; ideal pins, and contact in the pins of all four rods. Beside Exudyn: "
        "geometrically "
        f"exact beams, contact by functions of its own; its steps {1e3 * PEER_STEPS['ideal']:g} ms, with contact "
        f"{1e3 * PEER_STEPS['worn']:g} ms, ours 1 ms with sub-steps. Differences up to the first flight of a journal; after it "
        "motions differ by where flights end. Where accelerations with worn pins are several per cent apart the cause was not "
        "sought; place and forces agree there.\n",
        table(head, rows),
        "![Stops in four postures](papers_postures.png)\n",
    ]
