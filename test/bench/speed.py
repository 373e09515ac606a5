"""How fast a step, a twin's sample and a replay are, with Exudyn stepping the same boom in the same run.

Run ``python test/bench/speed.py`` on an idle machine; medians of five. Exudyn needs the extra ``peers``.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from boom_twin import Twin, load_scene, replay, simulate
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.validation.study.error.problem import at_rest, load_rig

SESSION = Path(__file__).parents[2] / "bags" / "arch_session"
SPAN, STEP = 4.0, 1e-3


def move(scene, t: np.ndarray) -> np.ndarray:
    """Strokes of a smooth move from posture arch, shape (len(t), n)."""
    x = np.clip(t / 1.5, 0.0, 1.0)
    q = 10 * x**3 - 15 * x**4 + 6 * x**5
    return strokes_of_posture(scene, "arch") + np.outer(q, [0.05, 0.0, 0.03, 0.0])


def median(task: Callable[[], float]) -> float:
    """Of five runs after a warm-up."""
    task()
    return statistics.median(task() for _ in range(5))


def timed(task: Callable[[], object]) -> float:
    """Seconds it takes."""
    start = time.perf_counter()
    task()
    return time.perf_counter() - start


def main() -> None:
    """Measure and print a Markdown table."""
    scene = load_scene()
    times = np.arange(0.0, SPAN + STEP / 2, STEP)
    strokes = move(scene, times)
    Twin(scene).warm_up()
    ours = median(lambda: timed(lambda: simulate(scene, times, strokes, STEP))) / (len(times) - 1)
    print("| what | measured |\n|---|---|")
    print(f"| a step of {1e3 * STEP:g} ms, start-up of `simulate` included | {1e6 * ours:.1f} us |")
    rig, missing = load_rig()
    if rig is None:
        print(f"| Exudyn | not measured: {missing} |")
    else:
        first = strokes[0]
        programme = rig.Programme(
            tuple(first), (rig.Move(0, 0.0, 1.5, first[0] + 0.05), rig.Move(2, 0.0, 1.5, first[2] + 0.03))
        )
        resting, scheme = at_rest(rig, scene, first, 4, lumped=True), rig.Scheme(kept=1, tolerance=3e-4)
        theirs = median(lambda: rig.move(resting, programme, SPAN, STEP, STEP, scheme)[1].seconds) / (len(times) - 1)
        print(f"| the same in Exudyn, 4 elements a section, lumped | {1e6 * theirs:.0f} us, {theirs / ours:.1f} times ours |")
    with tempfile.TemporaryDirectory() as out:
        factors = [replay(SESSION, scene, Path(out)).summary["realtime_factor"] for _ in range(5)]
    print(f"| replay of the bundled session | {statistics.median(factors):.1f} times real time |")


if __name__ == "__main__":
    main()
