"""What sensors can say of a softer section at best: Cramer-Rao bounds of its size over holds, against a learnt baseline.

    python test/bench/health/bound.py --baseline out/health/baseline_1.json

For the holds of the first sessions of `sections.py` (no noise is drawn): Fisher information of a section's compliance in
means of the residuals and natural frequencies, all healthy parameters free within the baseline's covariance, the model's error
of each channel and frequency as the baseline has it. Printed: the least standard deviation of the size, in percent of
compliance; beside it with errors of the model a tenth, and with the fifth frequency, which nothing excites today.
A fault is told (ln B of 12) from about 5.3 of these deviations on: 30 % softer are 43 % of compliance.
"""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

import numpy as np
import sections

from boom_twin import load_scene
from boom_twin.analysis.free_vibration import Vibration
from boom_twin.analysis.modal import natural_frequencies
from boom_twin.health.baseline import Baseline, load_baseline
from boom_twin.health.hold_test import rows_of
from boom_twin.health.inference import sensitivities
from boom_twin.health.inference.fault_catalogue import parameters
from boom_twin.health.inference.holds import HoldProblem, StillReadings
from boom_twin.health.inference.sensitivities import Signatures
from boom_twin.types import Array

SHARE = 1e-3  # of a frequency, its measured deviation
UNREST = np.array([1e-5] * 4 + [2e-3] * 2)  # rad and m/s^2: deviation of a hold's means
SECTIONS = range(1, 5)


def holds_of(signatures: Signatures, number: int, modes: int) -> list[HoldProblem]:
    """The two holds of a session, with so many frequencies measured."""
    sensitivities.MODES = 5
    programme, found = sections.programme(sections.drawn(number)), []
    at, boom = np.array(programme.first), signatures.nominal
    for k, pair in enumerate((programme.moves[:2], programme.moves[2:])):
        for move in pair:
            at[move.cylinder] = move.target
        if signatures.at(at) is None:
            return []
        own = natural_frequencies(boom.plan, boom.state, boom.work, 5, 1e-6)[:modes]
        vibrations = tuple(Vibration(f, SHARE * f, 0.01, 1e-3, 0.0) for f in own.tolist())
        start = k * 25_000_000_000
        work = signatures.hold(StillReadings(start, start + 20_000_000_000, at.copy(), np.zeros(6), UNREST, vibrations))
        assert work is not None
        while signatures.go_on(work):
            pass
        found.append(work.problem)
    return found


def bound(holds: list[HoldProblem], place: int, baseline: Baseline, covariance: Array, error: float) -> float:
    """Least standard deviation of a parameter's fault; the model's error is taken `error` times."""
    parts = [rows_of(hold, (error * baseline.errors(4)) ** 2, error * baseline.frequency_error) for hold in holds]
    rows = np.vstack([table[:, 1:] for table, _, _ in parts])
    own = np.concatenate([mine + model for _, mine, model in parts])
    spread = np.diag(own) + rows @ covariance @ rows.T
    return float(1.0 / np.sqrt(rows[:, place] @ np.linalg.solve(spread, rows[:, place])))


def main() -> None:
    """Print the table."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--baseline", type=Path, required=True)
    parser.add_argument("--count", type=int, default=12, help="sessions")
    args = parser.parse_args()
    scene, baseline = load_scene(), load_baseline(args.baseline)
    known = parameters(scene)
    places = {each.cause: i for i, each in enumerate(known)}
    _, covariance = baseline.healthy(known)
    signatures, found = Signatures(scene, known, (None,) * len(scene.joints)), []
    for number in range(args.count):
        three, five = (holds_of(signatures, number, modes) for modes in (3, 5))
        if three:
            at = [places[f"section_{i}.EI"] for i in SECTIONS]
            ways = ((three, 1.0), (three, 0.1), (five, 1.0))
            found.append([[bound(holds, place, baseline, covariance, error) for place in at] for holds, error in ways])
    low, middle, high = np.quantile(np.array(found), (0.0, 0.5, 1.0), axis=0)
    print(f"least deviation of compliance, percent: median (least - most) of {len(found)} sessions of two holds")
    print("| section | three frequencies | the model's error a tenth | five frequencies |\n|---|---|---|---|")
    for k, i in enumerate(SECTIONS):
        cells = [f"{100 * middle[w, k]:.1f} ({100 * low[w, k]:.1f}-{100 * high[w, k]:.1f})" for w in range(3)]
        print(f"| {i} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
