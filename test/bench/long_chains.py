"""What a step costs as a boom gets longer: a table, and a straight line through the cost.

    python test/bench/long_chains.py

Booms of 2 to 200 flexible sections in the same 20 m, steps of 1 ms; the smallest of many short interleaved runs. Above 100
sections a boom fills the cache of a core, so other work on the machine shows.
"""

from __future__ import annotations

import time

import numpy as np

from boom_twin.analysis.drive import PASSES, STEP_TOLERANCE
from boom_twin.analysis.equilibrium import settle
from boom_twin.analysis.simulate import RHO
from boom_twin.compiler.compile import compile_scene
from boom_twin.compiler.plan import width_of
from boom_twin.kernels.integrators import GENERALISED_ALPHA
from boom_twin.kernels.tables import State
from boom_twin.kernels.transfer.time_step import run
from boom_twin.scene.kinematics import posture_angles, strokes_of_posture
from boom_twin.scene.schema import Scene
from boom_twin.scene.segmentation import LEAST_PARTS
from boom_twin.validation.study.long_booms import long_boom

SECTIONS = (2, 5, 10, 20, 50, 100, 150, 200)
KINDS = ("B1", "B2", "B3")
STEP, STEPS, SPEED, BEGIN = 1e-3, 20, 1e-2, 5e-2  # s, -, travels of a cylinder per second, s from rest to it
ROUNDS = 150


def boom(count: int) -> Scene:
    """A boom of `count` sections with six-bars of all kinds."""
    return long_boom(count, kinds=KINDS)


class Runner:
    """A boom at rest in its posture, with drives that begin to move; `passes` per step of the last run."""

    def __init__(self, scene: Scene) -> None:
        self.plan = compile_scene(scene)
        self.start, self.work = self.plan.state(), self.plan.work()
        strokes = strokes_of_posture(scene, "test")
        settle(self.plan, self.start, self.work, strokes, posture_angles(scene, "test"))
        speeds = SPEED * np.array([joint.cylinder.max_stroke for joint in scene.joints])
        times = STEP * np.arange(1, STEPS + 1)[:, None]
        self.drives = self.plan.closed_lengths + strokes + speeds * times**2 / (2.0 * BEGIN)
        self.rates = speeds * times / BEGIN
        self.out = np.empty((1, width_of(self.plan)))
        self.passes = 0.0

    def seconds(self) -> float:
        """Wall time of a step, mean of a short run."""
        state = State(*(array.copy() for array in self.start))
        begun = time.perf_counter()
        status, _, passes, *_ = run(
            self.plan.tables, state, self.work, np.array([STEP]), np.array([STEPS]), self.drives, self.rates,
            GENERALISED_ALPHA, RHO, STEP_TOLERANCE, PASSES, None, self.out,
        )  # fmt: skip
        ended = time.perf_counter()
        assert status == 0, f"{self.plan.joints} sections: status {status}"
        self.passes = passes / STEPS
        return (ended - begun) / STEPS


def costs(runners: list[Runner], rounds: int = ROUNDS) -> np.ndarray:
    """Seconds per step, shape (runners,): the smallest of interleaved rounds."""
    return np.min([[runner.seconds() for runner in runners] for _ in range(rounds)], axis=0)


def line(counts: np.ndarray, seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fixed and per-section cost (s) of least relative squares, and relative residuals.

    Beams of booms of few sections are cut into more parts, so those are left out of the line: NaN.
    """
    terms, whole = np.stack([np.ones(len(counts)), counts], axis=1), counts >= LEAST_PARTS
    share = np.linalg.lstsq((terms / seconds[:, None])[whole], np.ones(whole.sum()), rcond=None)[0]
    return share, np.where(whole, seconds / (terms @ share) - 1.0, np.nan)


def main() -> None:
    """Measure and print."""
    counts = np.array(SECTIONS)
    runners = [Runner(boom(int(count))) for count in counts]
    seconds = costs(runners)
    (fixed, each), residuals = line(counts, seconds)
    head = ["sections", "unknowns", "us per step", "passes", "us per section", "off the line"]
    rows = []
    for n, one, t, off in zip(counts, runners, seconds, residuals, strict=True):
        row = [f"{n}", f"{len(one.plan.names)}", f"{1e6 * t:.1f}", f"{one.passes:.2f}", f"{1e6 * t / n:.2f}"]
        rows.append([*row, "-" if np.isnan(off) else f"{100 * off:+.1f} %"])
    print(f"| {' | '.join(head)} |\n{'|---' * len(head)}|")
    for row in rows:
        print(f"| {' | '.join(row)} |")
    long = counts >= 10
    slope = np.polyfit(np.log(counts[long]), np.log(seconds[long]), 1)[0]
    print(f"\n{1e6 * fixed:.1f} us + {1e6 * each:.2f} us a section; from 10 sections on the cost grows as n^{slope:.3f}")


if __name__ == "__main__":
    main()
