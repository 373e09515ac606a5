"""Study of parts: what each part of a model costs, and what leaving it out changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...analysis.motions import DURATION
from ...errors import SolverError
from ...plots.study import Bars, parts_picture
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
from ...reduction.variants import Variant, variants
from ...scene.schema import Scene
from ...system.atomic_files import write_atomic
from ...types import Array
from .report import machine, provenance, table, write_json

ROUNDS, QUICK_ROUNDS = 30, 5
QUICK_DURATION = 2.0  # s
NOTE = "surrogate parameters; one motion, another may differ"
HEAD = ("variant", "tip at rest, mm", "in", "tip in the move, rms mm", "largest mm", "f1, %", "f2, %", "f3, %", "step, us",
        "time saved, %", "unknowns", "status")  # fmt: skip


@dataclass(frozen=True)
class VariantCost:
    """One variant and what it does.

    Attributes
    ----------
    deviation : Deviation
        Of its tip from the full model's.
    shifts : ndarray, shape (`FREQUENCIES`,)
        Relative change of the natural frequencies about the start of the move; NaN where one of the models has none.
    step_time : float
        s; NaN where the move fails.
    unknowns : int
    status : str
        "ok", or why there are no numbers.
    """

    variant: Variant
    deviation: Deviation
    shifts: Array
    step_time: float
    unknowns: int
    status: str


@dataclass(frozen=True)
class PartsStudy:
    """A study. `full_times`: a step of the full model, measured twice, s; `parts` ascend in the error of the tip."""

    course: StrokeCourse
    frequencies: Array
    full_times: tuple[float, float]
    unknowns: int
    parts: tuple[VariantCost, ...]

    def saved(self, part: VariantCost) -> float:
        """Share of the full model's run time that leaving the part out saves; negative where it costs."""
        return 1.0 - part.step_time / self.full_times[0]


def measure(scene: Scene, course: StrokeCourse, rounds: int = ROUNDS) -> PartsStudy:
    """Every variant of a scene against the scene itself, times the least of `rounds`.

    Raises
    ------
    SolverError
        The scene itself has no equilibrium or fails in the move. A variant that does has a status.
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
    """Measure, and write ``parts.json``, ``parts.md`` and ``parts.png`` into the folder `out`; returns their paths.

    The move starts at `posture`; `quick`: it is short, and times are the least of few rounds.
    """
    course = course_of(scene, posture, QUICK_DURATION if quick else DURATION)
    found = measure(scene, course, QUICK_ROUNDS if quick else ROUNDS)
    out.mkdir(parents=True, exist_ok=True)
    paths = [out / f"parts.{kind}" for kind in ("json", "md", "png")]
    write_json(paths[0], {"machine": machine(), **as_json(found)})
    write_atomic(paths[1], as_markdown(found))
    parts_picture(paths[2], bars(found), NOTE)
    return paths


def as_json(found: PartsStudy) -> dict[str, Any]:
    """All numbers, SI units, shares as fractions."""
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
    """The report: how it was measured, and one table, ascending in the error of the tip."""
    frequencies = ", ".join(f"{value:.3f}" for value in found.frequencies)
    first, second = (1e6 * time for time in found.full_times)
    lines = [
        "# What the parts of a model cost, and what leaving them out changes\n",
        f"Every row is the scene after an edit (`parts.json` names it), against the scene as it is: {found.unknowns} unknowns, "
        f"{first:.2f} us a step (at the end of the rounds {second:.2f} us: what differs less than that is noise), natural "
        f"frequencies {frequencies} Hz.",
        f"At rest: the largest distance of the tips in {', '.join(found.course.names)}. Move: {found.course.motion.label}; "
        f"steps of {1e3 * found.course.step:g} ms. Frequencies: change about the rest at the start of the move. Time: stepping "
        "alone, least of interleaved runs of the move's beginning; what is negative costs time. Another motion may differ.\n",
        table(HEAD, [_row(found, part) for part in found.parts]),
        provenance(),
    ]
    return "\n".join(lines)


def _row(found: PartsStudy, part: VariantCost) -> Sequence[object]:
    off, good = part.deviation, part.status == "ok"
    errors = (1e3 * off.rest, off.where, 1e3 * off.rms, 1e3 * off.most) if good else (None, None, None, None)
    shifts = [100.0 * float(shift) for shift in part.shifts]
    time = (1e6 * part.step_time, 100.0 * found.saved(part)) if good else (None, None)
    return [part.variant.name, *errors, *shifts, *time, part.unknowns, part.status]


def bars(found: PartsStudy) -> Bars:
    """Return the bars of the picture: all but single sections with more modes than they have."""

    def shown(part: VariantCost) -> bool:
        single = part.variant.kind == "modes" and len(part.variant.edits) == 1
        return part.status == "ok" and not (single and part.unknowns > found.unknowns)

    good = [part for part in found.parts if shown(part)]
    return Bars(
        names=tuple(part.variant.name for part in good),
        rest=np.array([part.deviation.rest for part in good]),
        move=np.array([part.deviation.most for part in good]),
        saved=np.array([found.saved(part) for part in good]),
    )
