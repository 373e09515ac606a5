"""What is zero, and what no operation points to, costs no time: steps of such a boom over those of one that lacks it.

``python test/bench/absent.py`` prints two ratios, 1 within noise, and ends with 1 if one is above 1.05 in three attempts.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from property.test_unrelated import absent_and_zero, both, edited, empty_and_unused, stepped

from boom_twin.analysis.motions import motion_of

RUNS, ATTEMPTS, MOST = 30, 3, 1.05


def ratio(motion, one, other):
    """Least time of stepping `other` over that of `one`, in interleaved runs; each is a scene and the plan to use, or None."""
    times = [[stepped(motion, *box).seconds for box in (one, other)] for _ in range(RUNS)]
    first, second = np.min(times, axis=0)
    return second / first


def main() -> int:
    absent, zero = absent_and_zero()
    empty, unused = empty_and_unused()
    full = motion_of(edited(both()))
    worst = 0.0
    for name, motion, one, other in (
        ("what is zero over what is absent", motion_of(absent), (absent, None), (zero, None)),
        ("rows not in use over empty tables", full, empty, unused),
    ):
        found = []
        while len(found) < ATTEMPTS and (not found or found[-1] > MOST):
            found.append(ratio(motion, one, other))
        print(f"{name}: {', '.join(f'{each:.3f}' for each in found)}")
        worst = max(worst, min(found))
    return int(worst > MOST)


if __name__ == "__main__":
    sys.exit(main())
