"""Report of the study of the papers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from studies.clearance.scenes import ideal

from boom_twin import Scene, simulate, statics, undeflected
from boom_twin.analysis.equilibrium import settle
from boom_twin.analysis.modal import natural_modes
from boom_twin.analysis.motions import motion_of
from boom_twin.compiler.compile import BasisName, compile_scene
from boom_twin.scene.kinematics import posture_angles, skeleton, strokes_of_posture
from boom_twin.system.atomic_files import write_atomic
from boom_twin.validation.study.report import page, table

from .boundary_zeros import BoundaryZero, equilibrium, frequencies
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
    """One step size: difference from the sweep by substructure; error of the base force by the product."""

    step: float
    differences: tuple[float, ...]
    base_error: float


@dataclass(frozen=True)
class BasisRow:
    """One posture: sag (m) of the tip, frequencies (Hz) by default shapes and by cantilever modes."""

    posture: str
    sag: float
    default: tuple[float, ...]
    cantilever: tuple[float, ...]


@dataclass(frozen=True)
class PapersStudy:
    """All that was computed; see the fields' classes. `speeds`: see `low_speed.error_by_speed`."""

    matrices: tuple[MatrixCheck, ...]
    zeros: tuple[BoundaryZero, ...]
    bisected: tuple[tuple[float, float], ...]
    bases: tuple[BasisRow, ...]
    speeds: np.ndarray
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
    first = boundary_solution(own)
    right = own[0].inlet
    error = float(np.abs(first[4:] - right[4:]).max() / np.abs(right[4:]).max())
    return MatrixCheck(step, differences, error)


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
    rest = statics(scene, posture=posture, modes=0)
    sag = float(np.hypot(*(rest.tip - rest.tip_rigid)))
    return BasisRow(posture, sag, found["end-shapes"], found["cantilever"])


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


def write(scene: Scene, out: Path, quick: bool = False) -> list[Path]:
    """Measure, and write ``papers.md`` and two pictures into the folder `out`; returns their paths.

    `quick`: only the first posture, and few speeds.
    """
    found = measure(scene, list(scene.postures)[: 1 if quick else None], quick)
    paths = [out / name for name in ("papers.md", "papers_postures.png", "papers_low_speed.png")]
    write_atomic(paths[0], as_markdown(found))
    posture_picture(paths[1], "A stop in the papers' postures", NOTE, "Exudyn", [*_traces(found.stops)])
    low_speed_picture(
        paths[2], "Let go from the undeflected posture; the low-speed form", NOTE, found.speeds[:, 0], found.speeds[:, 1],
        list(found.let_go),
    )  # fmt: skip
    return paths


def _traces(stops: Sequence[Comparison]) -> list[StopTrace]:
    def trace(run: PostureRun, program: str) -> StopTrace:
        rise = 1e3 * (run.tip[:, 1] - run.tip[0, 1])
        return StopTrace(run.posture, run.pins, program, run.times, rise, run.acceleration[:, 1], 1e-3 * run.forces[:, 0])

    return [trace(run, program) for stop in stops for run, program in ((stop.own, "own"), (stop.peer, "peer"))]


def slope(found: PapersStudy) -> float:
    """Return the slope of the low-speed form's error over the speed, in logarithms, over the two slowest moves."""
    speeds, errors = np.log(found.speeds[:2, 0]), np.log(found.speeds[:2, 1])
    return float((errors[1] - errors[0]) / (speeds[1] - speeds[0]))


def as_markdown(found: PapersStudy) -> str:
    """Return the report."""
    parts = [
        "# The method's papers",
        "[Z] Zhang et al. 2016, *Research on the rigid-flexible multibody dynamics of concrete placing boom*; [R] Ren et al. "
        "2014, doi 10.1155/2014/943847. Their rigs and data are not public, so curves cannot be compared.",
        *_matrices_text(found), *_zeros_text(found), *_bases_text(found), *_low_speed_text(found), *_stops_text(found),
    ]  # fmt: skip
    return page(parts)


def _matrices_text(found: PapersStudy) -> list[str]:
    rows = [(1e3 * one.step, max(one.differences), one.base_error) for one in found.matrices]
    return [
        "## Transfer matrices",
        "Transfer matrices of A and B1 to B3 are assembled as in the papers. The difference is the largest relative one from "
        "the Riccati sweep. The product of all matrices, solved for the base force, loses digits.",
        table(("step, ms", "difference", "error of the product"), rows),
    ]


def _zeros_text(found: PapersStudy) -> list[str]:
    angle = max(abs(zero.bisected - zero.newton) for zero in found.zeros)
    share = max(abs(near / right - 1.0) for near, right in found.bisected)
    return [
        "## Boundary zeros by bisection",
        f"[R] bisects the boundary residual to 1e-7. So found, the rest angle of section 1 in {len(found.zeros)} postures "
        f"differs from Newton's by at most {angle:.1e} rad. {len(found.bisected)} natural frequencies differ from those "
        f"by Wittrick-Williams counting by at most {share:.1e}, relative.",
    ]


def _bases_text(found: PapersStudy) -> list[str]:
    rows = [
        (row.posture, 1e3 * row.sag, row.default[0], 100.0 * (row.cantilever[0] / row.default[0] - 1.0)) for row in found.bases
    ]
    return [
        "## Three cantilever modes a part",
        "Cantilever modes are too stiff: no sum of them has the bending moment and shear force at a part's end. The last "
        "column is the relative error of f1.",
        table(("posture", "sag, mm", "f1, Hz", "cantilever, %"), rows),
    ]


def _low_speed_text(found: PapersStudy) -> list[str]:
    held, lifted = found.let_go[:2]
    return [
        "## Without velocity terms",
        f"[R] leaves out Coriolis and centrifugal accelerations. The error grows as speed to the power {slope(found):.2f}.",
        table(("fastest tip, m/s", "largest error, mm"), found.speeds[:, :2] * [1.0, 1e3]),
        f"If an undeflected boom is released, its tip falls to {held.height.min():.0f} mm. If the drives lift it meanwhile, it "
        f"falls to {lifted.height.min():.0f} mm, then rises to {lifted.rest:.0f} mm, as [R] says.",
        "![Tip of a boom let go; error of the low-speed form](papers_low_speed.png)",
    ]


def _stops_text(found: PapersStudy) -> list[str]:
    by = {(stop.own.posture, stop.own.pins): stop for stop in found.stops}
    rows = [
        (name, 1e3 * by[name, "ideal"].tip if (name, "ideal") in by else None, 1e3 * worn.tip, 100.0 * worn.acceleration,
         100.0 * worn.forces, 100.0 * worn.penetration)
        for (name, pins), worn in by.items() if pins == "worn"
    ]  # fmt: skip
    return [
        "## Stops in four postures",
        "Rms differences from Exudyn (penetration: largest) until a pin first loses contact. Rod pins are worn, except in "
        '"tip, ideal". The reason for acceleration differences of several per cent is unknown.',
        table(("posture", "tip, ideal, mm", "tip, worn, mm", "acceleration, %", "forces, %", "penetration, %"), rows),
        "![Stops in four postures](papers_postures.png)",
    ]
