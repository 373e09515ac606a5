"""Study of parts: what each part of a model costs, and what leaving it out changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...analysis.motions import DURATION
from ...errors import SolverError
from ...reduction.deviation import (
    FREQUENCIES,
    Deviation,
    Response,
    StrokeCourse,
    answer,
    course_of,
    deviation,
    step_times,
    unknowns,
)
from ...reduction.search import Variant, variants
from ...scene.schema import Scene
from ...system.atomic_files import write_atomic
from ...types import Array
from .report import page, table, write_json

ROUNDS, QUICK_ROUNDS = 30, 5
HEAD = ("variant", "at rest, mm", "moving, mm", "f1, %", "time saved, %")


@dataclass(frozen=True)
class VariantCost:
    """One variant, its deviation from the full model, and its cost."""

    variant: Variant
    deviation: Deviation
    shifts: Array  # (`FREQUENCIES`,), relative, of natural frequencies at the start of the move; NaN if a model lacks one
    step_time: float  # s; NaN where the move fails
    unknowns: int
    status: str  # "ok", or why there are no numbers


@dataclass(frozen=True)
class PartsStudy:
    """A study. `full_times`: a step of the full model, measured twice, s; `parts` ascend in the error of the tip."""

    course: StrokeCourse
    frequencies: Array
    full_times: tuple[float, float]
    unknowns: int
    parts: tuple[VariantCost, ...]

    def saved(self, part: VariantCost) -> float:
        """Return the share of the full model's run time that leaving the part out saves; negative where it costs."""
        return 1.0 - part.step_time / self.full_times[0]

    @property
    def shown(self) -> tuple[VariantCost, ...]:
        """Return the variants of the page: no other numbers of shapes in one section of several; the JSON has them."""
        several = len(self.course.motion.first) > 1
        return tuple(p for p in self.parts if not (several and p.variant.kind == "modes" and len(p.variant.edits) == 1))


def measure(scene: Scene, course: StrokeCourse, rounds: int = ROUNDS) -> PartsStudy:
    """Compare every variant of a scene with the scene itself; times are the least of `rounds`.

    SolverError if the scene itself has no equilibrium or fails in the move; a variant that does has a status.
    """
    found = variants(scene)
    full = answer(scene, course, FREQUENCIES)
    if full.status != "ok":
        raise SolverError(f"the scene itself fails: {full.status}")
    answers = [answer(variant.of(scene), course, FREQUENCIES) for variant in found]
    able = [k for k, one in enumerate(answers) if one.status == "ok"]
    times = np.full(len(found), np.nan)
    least = step_times([scene, *(found[k].of(scene) for k in able), scene], course, rounds)
    times[able] = least[1:-1]
    parts = [_part(scene, *row, full, course) for row in zip(found, answers, times.tolist(), strict=True)]
    parts.sort(key=lambda part: (part.deviation.worst, part.variant.name))
    return PartsStudy(course, full.frequencies, (float(least[0]), float(least[-1])), unknowns(scene), tuple(parts))


def _part(scene: Scene, variant: Variant, found: Response, time: float, full: Response, course: StrokeCourse) -> VariantCost:
    shifts = np.full(FREQUENCIES, np.nan)
    both = min(len(found.frequencies), len(full.frequencies))
    shifts[:both] = found.frequencies[:both] / full.frequencies[:both] - 1.0
    return VariantCost(variant, deviation(found, full, course), shifts, time, unknowns(variant.of(scene)), found.status)


def write(scene: Scene, out: Path, quick: bool = False, posture: str | None = None) -> list[Path]:
    """Measure in a move from `posture`; write parts.json and parts.md into the folder `out`; return their paths."""
    course = course_of(scene, posture, 2.0 if quick else DURATION)
    found = measure(scene, course, QUICK_ROUNDS if quick else ROUNDS)
    paths = [out / f"parts.{kind}" for kind in ("json", "md")]
    write_json(paths[0], as_json(found))
    write_atomic(paths[1], as_markdown(found))
    return paths


def as_json(found: PartsStudy) -> dict[str, Any]:
    """Return all numbers, SI units, shares as fractions."""
    return {
        "at_rest_in": found.course.names,
        "move": found.course.motion.label,
        "step_s": found.course.step,
        "full": {"frequencies_Hz": found.frequencies, "step_times_s": found.full_times, "unknowns": found.unknowns},
        "variants": [
            {
                "name": part.variant.name,
                "kind": part.variant.kind,
                "edits": "; ".join(map(str, part.variant.edits)),
                "rest_error_m": part.deviation.rest,
                "rest_error_at": part.deviation.where,
                "move_error_rms_m": part.deviation.rms,
                "move_error_max_m": part.deviation.most,
                **{f"f{k + 1}_shift": shift for k, shift in enumerate(part.shifts)},
                "step_time_s": part.step_time,
                "time_saved": found.saved(part),
                "unknowns": part.unknowns,
                "status": part.status,
            }
            for part in found.parts
        ],
    }


def as_markdown(found: PartsStudy) -> str:
    """Return the report: how it was measured, and one table, ascending in the error of the tip."""
    first, second = (1e6 * time for time in found.full_times)
    parts = [
        "# What the parts of a model cost, and what leaving them out changes",
        f"Each row compares an edited scene with the full scene ({found.unknowns} unknowns). A step of the full scene took "
        f"{first:.2f} us, and {second:.2f} us at the end. Smaller differences are noise.",
        f"- At rest: largest distance between the tips. States: {', '.join(found.course.names)}.\n"
        f"- Moving: the same in a move with steps of {1e3 * found.course.step:g} ms. Move: {found.course.motion.label}.\n"
        f"- f1: change of the first natural frequency ({found.frequencies[0]:.3f} Hz).\n"
        "- Time saved: stepping alone, minimum of interleaved runs. Negative means slower.",
        "Leave out parts whose error you accept, if that saves time. `boom_twin check --need` makes the reduced scene. "
        "`parts.json` adds the edits, other frequencies, and single sections with other mode numbers.",
        table(HEAD, [_row(found, part) for part in found.shown]),
        "Limits: another motion may differ. Leaving out several parts may cause larger errors.",
    ]
    return page(parts)


def _row(found: PartsStudy, part: VariantCost) -> Sequence[object]:
    if part.status != "ok":
        return [f"{part.variant.name}: {part.status}", *[None] * (len(HEAD) - 1)]
    off = part.deviation
    return [part.variant.name, 1e3 * off.rest, 1e3 * off.most, 100.0 * float(part.shifts[0]), 100.0 * found.saved(part)]
