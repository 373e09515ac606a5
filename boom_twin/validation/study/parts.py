"""Study of parts: what each part of a model costs, and what leaving it out changes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...analysis.methods import DURATION
from ...errors import SolverError
from ...reduction.deviation import FREQUENCIES, Response, StrokeCourse, answer, course_of, deviation, step_times, unknowns
from ...reduction.search import Variant, variants
from ...scene.schema import Scene
from ...system.files import write_atomic
from .report import page, table, write_json

HEAD = ("variant", "at rest, mm", "moving, mm", "f1, %", "time saved, %")


def write(scene: Scene, out: Path, quick: bool = False, posture: str | None = None) -> list[Path]:
    """Measure in a move from `posture`; write parts.json and parts.md into the folder `out`; return their paths."""
    course = course_of(scene, posture, 2.0 if quick else DURATION)
    found = measure(scene, course, 5 if quick else 30)
    paths = [out / f"parts.{kind}" for kind in ("json", "md")]
    write_json(paths[0], found)
    write_atomic(paths[1], as_markdown(found, several=len(scene.sections) > 1))
    return paths


def measure(scene: Scene, course: StrokeCourse, rounds: int) -> dict[str, Any]:
    """Compare every variant of a scene with the scene itself; times are the least of `rounds`. SI units, shares as fractions.

    ``full`` is of the scene itself, its step timed before and after all others. ``variants`` ascend in the error of the tip.
    SolverError if the scene itself has no equilibrium or fails in the move; a variant that does has a status.
    """
    full = answer(scene, course, FREQUENCIES)
    if full.status != "ok":
        raise SolverError(f"the scene itself fails: {full.status}")
    found = variants(scene)
    scenes = [variant.of(scene) for variant in found]
    answers = [answer(each, course, FREQUENCIES) for each in scenes]
    able = [k for k, one in enumerate(answers) if one.status == "ok"]
    first, *least, last = step_times([scene, *(scenes[k] for k in able), scene], course, rounds).tolist()
    times = dict(zip(able, least, strict=True))
    rows = [
        _deviation(variant, response, full, course)
        | {"step_time_s": times.get(k, np.nan), "time_saved": 1.0 - times.get(k, np.nan) / first}
        | {"unknowns": unknowns(scenes[k]), "status": response.status}
        for k, (variant, response) in enumerate(zip(found, answers, strict=True))
    ]
    rows.sort(key=lambda row: (max(row["rest_error_m"], row["move_error_max_m"]), row["name"]))
    return {
        "at_rest_in": course.names,
        "move": course.motion.label,
        "step_s": course.step,
        "full": {"frequencies_Hz": full.frequencies, "step_times_s": (first, last), "unknowns": unknowns(scene)},
        "variants": rows,
    }


def _deviation(variant: Variant, found: Response, full: Response, course: StrokeCourse) -> dict[str, Any]:
    """Return a variant and its deviation; shifts of natural frequencies are relative, and NaN if a model lacks one."""
    off, shifts = deviation(found, full, course), np.full(FREQUENCIES, np.nan)
    both = min(len(found.frequencies), len(full.frequencies))
    shifts[:both] = found.frequencies[:both] / full.frequencies[:both] - 1.0
    return {
        "name": variant.name,
        "kind": variant.kind,
        "edits": "; ".join(map(str, variant.edits)),
        "rest_error_m": off.rest,
        "rest_error_at": off.where,
        "move_error_rms_m": off.rms,
        "move_error_max_m": off.most,
        **{f"f{k}_shift": shift for k, shift in enumerate(shifts.tolist(), start=1)},
    }


def as_markdown(found: Mapping[str, Any], several: bool) -> str:
    """Return the report: how it was measured, and one table, ascending in the error of the tip.

    On a boom of `several` sections, other numbers of shapes in one of them are not shown; the JSON has them.
    """
    full = found["full"]
    first, second = (1e6 * time for time in full["step_times_s"])
    shown = [row for row in found["variants"] if not (several and row["kind"] == "modes" and ";" not in row["edits"])]
    parts = [
        "# What the parts of a model cost, and what leaving them out changes",
        f"Each row compares an edited scene with the full scene ({full['unknowns']} unknowns). A step of the full scene took "
        f"{first:.2f} us, and {second:.2f} us at the end. Smaller differences are noise.",
        f"- At rest: largest distance between the tips. States: {', '.join(found['at_rest_in'])}.\n"
        f"- Moving: the same in a move with steps of {1e3 * found['step_s']:g} ms. Move: {found['move']}.\n"
        f"- f1: change of the first natural frequency ({full['frequencies_Hz'][0]:.3f} Hz).\n"
        "- Time saved: stepping alone, minimum of interleaved runs. Negative means slower.",
        "Leave out parts whose error you accept, if that saves time. `boom_twin check --need` makes the reduced scene. "
        "`parts.json` adds the edits, other frequencies, and single sections with other mode numbers.",
        table(HEAD, map(_row, shown)),
        "Limits: another motion may differ. Leaving out several parts may cause larger errors.",
    ]
    return page(parts)


def _row(part: Mapping[str, Any]) -> list[object]:
    if part["status"] != "ok":
        return [f"{part['name']}: {part['status']}", *[None] * (len(HEAD) - 1)]
    sizes = 1e3 * part["rest_error_m"], 1e3 * part["move_error_max_m"], 100.0 * part["f1_shift"], 100.0 * part["time_saved"]
    return [part["name"], *sizes]
