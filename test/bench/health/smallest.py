"""The smallest softening of each section that holds can tell: from the covariance of the holds of healthy sessions.

    python test/bench/health/sections.py --make --count 96 --out out/health      # the sessions, and those to learn from
    python test/bench/health/smallest.py 12 28 60 --out out/health

A fault of size s is e^(s^2 / (2 sigma^2)) times as probable as none, on average, where sigma is what the rows of all holds
leave of it beside healthy parameters and the model's error. An alarm takes e^12, and the prior of one cause among all.
"""

from __future__ import annotations

import math
import os
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import run
import sections
import stored

from boom_twin import Twin, load_scene
from boom_twin.health.baseline import load_baseline
from boom_twin.health.hold_test import HoldTest
from boom_twin.health.residual_monitor import HELD
from boom_twin.types import StrokeReading


def smallest(number: int, out: Path) -> list[float]:
    """Share by which each section must be softer to be told in the holds of a healthy session."""
    each, seen = sections.drawn(number), []
    take = HoldTest.take

    def watched(self: HoldTest, *args: Any) -> Any:
        seen.append((self, *args[1:]))
        return take(self, *args)

    HoldTest.take = watched  # type: ignore[method-assign]
    try:
        twin = Twin(load_scene(), baseline=load_baseline(run.baseline_file(out, each.rig)), reads=StrokeReading.DRIVE)
        samples = stored.load_samples(out / "section_sessions", each)
        for first in range(0, len(samples), run.AT_ONCE):
            run._health(twin, samples[first : first + run.AT_ONCE])
    finally:
        HoldTest.take = take  # type: ignore[method-assign]
    test, _, covariance = seen[-1]
    (_, left, signatures), _, _ = test._whitened()
    names = [known.cause for known in test._bank.known]
    spread = np.eye(len(left)) + signatures @ covariance @ signatures.T
    found = []
    for section in range(len(load_scene().joints)):
        fault = signatures[:, names.index(f"section_{section + 1}.EI")]
        size = math.sqrt(2.0 * (HELD + math.log(len(names))) / float(fault @ np.linalg.solve(spread, fault)))
        found.append(size / (1.0 + size))  # the parameter is what compliance grows by
    return found


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("numbers", type=int, nargs="+", help="of healthy sessions")
    parser.add_argument("--out", type=Path, default=Path("out/health"))
    args = parser.parse_args()
    for number in args.numbers:
        each = sections.drawn(number)
        print(number, each.rig, each.posture, " ".join(f"{share:.0%}" for share in smallest(number, args.out)), flush=True)
