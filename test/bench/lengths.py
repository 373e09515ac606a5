"""Prediction and estimate from cylinder lengths against the virtual rig (synthetic): rows of docs/measured.md.

    python test/bench/lengths.py --out out/lengths [--only NAME ..]

Sessions are made once and kept in the folder. A row has the rms error of the tip (mm) and of its acceleration (m/s^2),
predicted from lengths alone and estimated with angles and IMU; then the estimate's error over its stated deviation.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

import numpy as np
from record import keep

from boom_twin import replay
from boom_twin.cli.main import main as boom_twin
from boom_twin.offline.ground_truth import load_truth

SECONDS, SETTLED = 60, 2.0  # of a session; s that are not counted
PUMP, WRONG = ("--load", "pump:0.43:130@5", "--load", "wind:15"), ("--wrong", "0.02", "--rig-seed")
CASES: dict[str, tuple[str, ...]] = {
    "quiet": ("--seed", "21"),
    "quiet, rig 2 % wrong": ("--seed", "22", *WRONG, "1"),
    "pump 130 N and wind": ("--seed", "21", *PUMP),
    "pump 60 N and wind": ("--seed", "23", "--load", "pump:0.6:60@5", "--load", "wind:15"),
    "pump 130 N and wind, rig 2 % wrong": ("--seed", "24", *WRONG, "2", *PUMP),
    "pump 250 N and wind, rig 2 % wrong": ("--seed", "25", *WRONG, "3", "--load", "pump:0.35:250@5", "--load", "wind:15"),
    "k_2 30 % softer from 20 s on": ("--seed", "21", "--fault", "cylinder_2.k:softer:0.3@20+5"),
    "k_1 30 % softer": ("--seed", "21", "--fault", "cylinder_1.k:softer:0.3"),
    "payload 20 kg untold": ("--seed", "21", "--fault", "tip.payload:more:20"),
    "transducer 2 stuck from 20 s on": ("--seed", "21", "--fault", "cylinder_2.sensor:stuck@20"),
    "encoder 3 drifts 0.1 mrad/s from 20 s on": ("--seed", "21", "--fault", "joint_3.sensor:drift:0.0001@20"),
}


def rms(rows: np.ndarray) -> float:
    """Return the root mean square of vectors (k, 2)."""
    return float(np.sqrt(np.mean(np.sum(rows**2, axis=1))))


def row_of(session: Path) -> list[float]:
    """Return the row of a session."""
    shutil.rmtree(session.with_name(f"{session.name}_replayed"), ignore_errors=True)
    truth, stretch = (
        load_truth(session),
        replay(session, None, session.with_name(f"{session.name}_replayed"), with_bag=False).recording.whole,
    )
    assert truth is not None
    predictions, estimates = stretch.predictions, stretch.estimates
    times = (predictions.stamps - predictions.stamps[0]) * 1e-9 + truth.times[0]
    counted = times > times[0] + SETTLED
    position, acceleration = (truth.at(times, values)[counted] for values in (truth.position, truth.acceleration))
    tip, felt = estimates.tip[counted, :2] - position, estimates.acceleration[counted, :2] - acceleration
    stated, stated_felt = (each[counted][:, [0, 3]] for each in (estimates.tip_covariance, estimates.acceleration_covariance))
    return [
        1e3 * rms(predictions.tip_position[counted] - position),
        rms(predictions.tip_acceleration[counted] - acceleration),
        1e3 * rms(tip),
        rms(felt),
        float(np.sqrt(np.mean(tip**2 / stated))),
        float(np.sqrt(np.mean(felt**2 / stated_felt))),
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/lengths"))
    parser.add_argument("--only", nargs="*", default=list(CASES))
    parser.add_argument("--posture", default="arch")
    arguments = parser.parse_args()
    print(
        "| session | predicted: tip, mm | acceleration | estimated: tip, mm | acceleration | over stated: tip | acceleration |"
    )
    print("|---|---|---|---|---|---|---|")
    found: dict[str, list[float]] = {}
    for name in arguments.only:
        folder = arguments.out / name.replace(" ", "_").replace(",", "").replace("%", "percent").replace("/", "_")
        if not folder.exists():
            boom_twin(["rig", "--out", str(folder), "--random", arguments.posture, "--duration", str(SECONDS), *CASES[name]])
        found[name] = row_of(folder)
        print(f"| {name} | " + " | ".join(f"{value:.3g}" for value in found[name]) + " |", flush=True)
    keep("lengths", found)


if __name__ == "__main__":
    main()
