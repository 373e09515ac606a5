"""Report of the study of the papers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from default_boom import motion_of, posture_angles, skeleton, strokes_of_posture
from studies.clearance.scenes import ideal

from boom_twin import Scene, simulate, statics
from boom_twin.analysis.equilibrium import settle
from boom_twin.analysis.modal import natural_modes
from boom_twin.compiler.compile import BasisName, compile_scene
from boom_twin.plots.style import BLUE, GREY, ORANGE, picture
from boom_twin.system.files import write_atomic
from boom_twin.validation.study.report import page, table

from .let_go import undeflected
from .low_speed import error_by_speed


@dataclass(frozen=True)
class LetGoTrace:
    """Motion of a boom let go from the undeflected posture.

    Name; times (s) and height over that posture (mm), shape (m,); that height at rest (mm).
    """

    name: str
    times: np.ndarray
    height: np.ndarray
    rest: float


def low_speed_picture(
    path: Path, title: str, note: str, speeds: np.ndarray, errors: np.ndarray, traces: list[LetGoTrace]
) -> None:
    """Write the tip of booms that are let go, and errors (m) of the low-speed form over the fastest tip (m/s), both (k,)."""
    with picture(path, title, note, (16.0, 6.8)) as figure:
        left, right = figure.subplots(1, 2)
        for trace, colour in zip(traces, (BLUE, ORANGE), strict=False):
            left.plot(trace.times, trace.height, color=colour, label=trace.name)
            left.axhline(trace.rest, color=colour, linewidth=0.8, linestyle=":")
        left.set_xlabel("time, s")
        left.set_ylabel("height of the tip over the undeflected posture, mm")
        left.legend(loc="best")
        right.loglog(speeds, 1e3 * errors, color=BLUE, marker="o", label="largest error of the tip")
        guide = 1e3 * errors[0] * (speeds / speeds[0]) ** 2
        right.loglog(speeds, guide, color=GREY, linestyle=":", label="square of the speed")
        right.set_xlabel("fastest tip, m/s")
        right.set_ylabel("error without Coriolis and centrifugal terms, mm")
        right.legend(loc="best")
        right.set_xlim(0.9 * float(np.min(speeds)), 1.1 * float(np.max(speeds)))


RISES, QUICK_RISES = (24.0, 12.0, 6.0, 3.0, 1.5, 0.75), (6.0, 3.0)  # s
HELD = 3.0  # s, of a boom that is let go
MODES = 4
NOTE = "surrogate parameters; nothing was measured on a rig"


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

    bases: tuple[BasisRow, ...]
    speeds: np.ndarray
    let_go: tuple[LetGoTrace, ...]


def measure(scene: Scene, postures: Sequence[str], quick: bool) -> PapersStudy:
    """Compute everything; scenes with clearance are taken with ideal pins where the papers' form knows no other."""
    bare = ideal(scene)
    return PapersStudy(
        tuple(_bases(bare, posture) for posture in postures),
        error_by_speed(bare, motion_of(bare), QUICK_RISES if quick else RISES),
        _let_go(bare, postures[0]),
    )


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
    start, move = undeflected(scene, strokes, angles), motion_of(scene, posture)
    times = np.arange(0.0, HELD + 1e-9, 5e-3)
    height = float(skeleton(scene, angles).pivots[-1][1])
    found = []
    for name, drive in (("drives held", np.tile(strokes, (len(times), 1))), ("drives lift the boom", move(times)[0])):
        moved = simulate(scene, times, drive, 1e-3, angles, estimate_errors=False, start=start)
        rest = simulate(scene, np.zeros(1), drive[-1:], 1e-3, estimate_errors=False).tip[0, 1]
        found.append(LetGoTrace(name, times, 1e3 * (moved.tip[:, 1] - height), 1e3 * float(rest - height)))
    return tuple(found)


def write(scene: Scene, out: Path, quick: bool = False) -> list[Path]:
    """Measure, and write ``papers.md`` and a picture into the folder `out`; returns their paths.

    `quick`: only the first posture, and few speeds.
    """
    found = measure(scene, list(scene.postures)[: 1 if quick else None], quick)
    paths = [out / name for name in ("papers.md", "papers_low_speed.png")]
    write_atomic(paths[0], as_markdown(found))
    low_speed_picture(
        paths[1], "Let go from the undeflected posture; the low-speed form", NOTE, found.speeds[:, 0], found.speeds[:, 1],
        list(found.let_go),
    )  # fmt: skip
    return paths


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
        *_bases_text(found), *_low_speed_text(found),
    ]  # fmt: skip
    return page(parts)


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
