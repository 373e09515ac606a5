"""How fast a step, a twin's sample and a replay are, with Exudyn stepping the same boom in the same run.

Run ``python test/bench/speed.py`` on an idle machine; medians of five. Exudyn needs the extra ``peers``.
"""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from boom_twin import load_scene, replay
from boom_twin.analysis.methods import integrate_with, motion_of
from boom_twin.offline.replay import Replay
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.validation.study.error_runs import ROW, at_rest, every, load_rig

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


def step_times() -> tuple[float, float]:
    """Return CPU seconds of a step of this model, and of Exudyn at its best within 0.3 mm."""
    scene = load_scene()
    motion, steps = motion_of(scene, "arch", SPAN), SPAN / STEP
    ours = median(lambda: integrate_with(scene, motion, SPAN, STEP, every(STEP), angles=motion.angles).seconds)
    rig = load_rig()
    resting, scheme = at_rest(rig, scene, motion.first, 3, lumped=True), rig.Scheme(kept=1, tolerance=3e-4)
    return ours / steps, median(lambda: rig.move(resting, motion, SPAN, STEP, ROW, scheme)[1].seconds) / steps


def replays(session: Path = SESSION, count: int = 5) -> tuple[float, Replay]:
    """Return the median of some replays' speeds over real time, and the last replay."""
    with tempfile.TemporaryDirectory() as out:
        done = [replay(session, None, Path(out)) for _ in range(count)]
    return statistics.median(each.summary["realtime_factor"] for each in done), done[-1]


def main() -> None:
    """Measure and print a Markdown table."""
    ours, theirs = step_times()
    print("| what | measured |\n|---|---|")
    print(f"| a step of {1e3 * STEP:g} ms, CPU time | {1e6 * ours:.2f} us |")
    print(f"| the same in Exudyn, 3 elements a section, lumped | {1e6 * theirs:.0f} us, {theirs / ours:.1f} times ours |")
    print(f"| replay of the bundled session | {replays()[0]:.1f} times real time |")


if __name__ == "__main__":
    main()
