"""Many twins in one call: cost of a twin's step against a single one, on one core and on all.

    python test/bench/batch.py

1000 booms with oil springs of their own follow one drive from rest, 200 steps in a call, then one step in a call; least of
five. A second run of the same drive that went on from the end of the first would begin with a jump, and take more passes.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from boom_twin.analysis.batch import Batch
from boom_twin.analysis.methods import integrate_with
from boom_twin.compiler.compile import compile_scene
from boom_twin.compiler.plan import Plan
from boom_twin.scene import Scene, load_scene
from boom_twin.scene.kinematics import posture_angles, strokes_of_posture

TWINS, STEPS, STEP = 1000, 200, 1e-3


def plans(scene: Scene) -> list[Plan]:
    """Booms whose cylinders are up to 20 % softer or stiffer."""
    rng, found = np.random.default_rng(0), []
    for _ in range(TWINS):
        plan = compile_scene(scene)
        plan.tables.cylinders.compliance[:] *= rng.uniform(0.8, 1.2, plan.joints)
        found.append(plan)
    return found


def least(prepare: Callable[[], object], task: Callable[[], object]) -> float:
    """Seconds of the fastest of five runs, each after its preparation."""
    seconds = []
    for _ in range(5):
        prepare()
        begun = time.perf_counter()
        task()
        seconds.append(time.perf_counter() - begun)
    return min(seconds)


def main() -> None:
    """Measure and print a Markdown table."""
    scene = load_scene()
    start, angles = strokes_of_posture(scene, "arch"), posture_angles(scene, "arch")

    def drive(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return start + np.outer(times**3, [0.05, 0.0, 0.03, 0.0]), np.outer(3 * times**2, [0.05, 0.0, 0.03, 0.0])

    alone = min(integrate_with(scene, drive, STEPS * STEP, STEP, angles=angles).seconds for _ in range(31)) / STEPS
    print("| what | us for a step of one twin |\n|---|---|")
    print(f"| a single twin, {STEPS} steps in a call | {1e6 * alone:.2f} |")
    booms = plans(scene)
    strokes, rates = drive(STEP * np.arange(1, STEPS + 1))
    for cores in range(1, len(os.sched_getaffinity(0)) + 1):
        batch = Batch(booms, cores)
        for count in (STEPS, 1):
            at_rest, run = partial(batch.settle, start, angles), partial(batch.run, STEP, strokes[:count], rates[:count])
            spent = least(at_rest, run) / count / TWINS
            says = f"{TWINS} twins, {cores} core{'s' * (cores > 1)}, {count} step{'s' * (count > 1)} in a call"
            print(f"| {says} | {1e6 * spent:.2f} |")


if __name__ == "__main__":
    main()
