"""A calibration with truth: the figures and pictures of docs/calibrate.md.

Run ``python test/bench/calibration_truth.py``. The virtual rig's default boom has stiffnesses 8 to 10 % off, 15 kg at the tip
and encoders 0.1 deg off; a session of 60 s is fitted, another motion is held out.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from calibration.sessions import ENCODERS, made, off

from boom_twin import load_scene
from boom_twin.cli.main import main

DOCS = Path(__file__).parents[2] / "docs"


def run() -> int:
    """Make the sessions, calibrate, keep the pictures."""
    truth = off(load_scene(), 1.1, 0.9, 1.08, 0.92, **{"tip.payload": 15.0})
    with tempfile.TemporaryDirectory() as folder:
        sessions = [("moves", "arch", 1), ("other_moves", "high", 2)]
        bags = [made(truth, posture, 60.0, seed).write(Path(folder) / name, seed, ENCODERS) for name, posture, seed in sessions]
        out = Path(folder) / "calibrated.yaml"
        code = main(["calibrate", *map(str, bags), "--load", "payload", "--out", str(out)])
        for kind in ("residuals", "parameters"):
            shutil.copy(out.with_suffix(f".{kind}.png"), DOCS / f"calibrate_{kind}.png")
    return code


if __name__ == "__main__":
    sys.exit(run())
