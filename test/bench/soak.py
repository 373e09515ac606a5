"""Memory of the live node over many minutes of 200 Hz: ``python test/bench/soak.py [--duration 600]``; also run by make soak.

The resident memory of the node is sampled every second. Exit code 1 if, after 100 s, a straight line through it rises by more
than 1 MB.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser
from pathlib import Path

import numpy as np
from live import memory

from boom_twin.ros.isolation import isolated

SETTLING = 100.0
"""Time (s) before memory is looked at: windows of residuals, loads and alarms fill up to a minute and a half from the start."""
LARGEST = 1.0
"""MB."""


def main() -> int:
    """Run, print what was found."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--duration", type=float, default=600.0, help="s (600)")
    parser.add_argument("--rate", type=float, default=200.0, help="of strokes and of angles, Hz (200)")
    args = parser.parse_args()
    with isolated():
        rows = np.array(samples(args.rate, args.duration))
    time_s, resident = rows[rows[:, 0] > SETTLING].T
    slope = np.polyfit(time_s, resident, 1)[0]
    rise = slope * (time_s[-1] - time_s[0])
    print(f"{len(rows)} s at {args.rate:g} Hz: {resident[0]:.2f} MB after {SETTLING:g} s, {resident[-1]:.2f} MB at the end")
    print(f"slope {60.0 * slope:.3f} MB/min, rise {rise:.2f} MB, bound {LARGEST:g} MB")
    return 0 if rise <= LARGEST else 1


def samples(rate: float, duration: float) -> list[tuple[float, float]]:
    """Time (s) since the first message, and resident memory (MB), every second while messages come."""
    live = [sys.executable, str(Path(__file__).with_name("live.py"))]
    with tempfile.TemporaryFile("w+") as nowhere:
        node = subprocess.Popen([sys.executable, "-m", "boom_twin.ros.node.main"], stdout=nowhere, stderr=nowhere)
        listener = subprocess.Popen([*live, "listen", "boom_twin", "forget"], stdout=nowhere)
        source = subprocess.Popen([*live, "source", str(rate), str(duration)], stdout=subprocess.PIPE, text=True)
        try:
            assert source.stdout is not None
            if "sending" not in source.stdout.readline():
                raise SystemExit("the node did not start")
            began, rows = time.monotonic(), []
            while source.poll() is None and time.monotonic() - began < duration:
                rows.append((time.monotonic() - began, memory(node)))
                time.sleep(1.0)
            if node.poll() is not None:
                raise SystemExit(f"the node ended with {node.returncode}")
        finally:
            for process in (source, listener, node):
                process.kill()
    return rows


if __name__ == "__main__":
    sys.exit(main())
