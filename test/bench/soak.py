"""Memory, loss and log of the live node over many minutes: ``python test/bench/soak.py [--duration 600]``; also by make soak.

Samples carry the time at which they were due: a source that a busy computer keeps waiting sends them late, not wrong.

The resident memory of the node is sampled every second. Exit code 1 if, after 340 s, it rises by more than 1 MB, if a sample
has no prediction or no residual, or if the log has 100 lines or more. A rise is what pieces of ten seconds come to, without the
two largest: messages that waited on a busy computer leave behind what they took, once, and a leak goes on.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np
from live import memory
from record import keep

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from demo.isolation import isolated

SETTLING = 340.0
"""Time (s) before memory is looked at: each fault twin keeps 16 384 expected readings of angles, at 50 Hz those of 328 s."""
LARGEST = 1.0
"""MB."""
PIECE, BACKLOGS = 10.0, 2
"""Time (s) over which a rise is taken, and how many of these are left out."""
LINES = 100
"""Lines of the log that are too many."""


def main() -> int:
    """Run, print what was found."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--duration", type=float, default=600.0, help="s (600)")
    parser.add_argument("--rate", type=float, default=200.0, help="of strokes and of angles, Hz (200)")
    args = parser.parse_args()
    with isolated():
        found = soaked(args.rate, args.duration)
    rows = np.array(found.memory)
    time_s, resident = rows[rows[:, 0] > SETTLING].T
    pieces = np.sort(np.diff(np.interp(np.arange(time_s[0], time_s[-1], PIECE), time_s, resident)))
    rise, largest = pieces[:-BACKLOGS].mean() * len(pieces), pieces[-BACKLOGS:]
    print(f"{len(rows)} s at {args.rate:g} Hz: {resident[0]:.2f} MB after {SETTLING:g} s, {resident[-1]:.2f} MB at the end")
    print(f"rise {rise:.2f} MB, bound {LARGEST:g} MB; left out of it, largest of {PIECE:g} s: {largest.round(2).tolist()} MB")
    due = {"tip/position": found.sent, "residuals": 2 * found.sent - 1}  # of strokes, but for the first, and of angles
    lost = {name: count - found.heard[name] for name, count in due.items()}
    print(f"{found.sent} samples sent; without prediction {lost['tip/position']}, without residuals {lost['residuals']}")
    keep(f"soak_{args.rate:g}", {"seconds": len(rows), "sent": found.sent, "lost": sum(lost.values()), "rise_MB": rise})
    print(f"{len(found.log)} lines in the log, fewer than {LINES} wanted; the last:", *found.log[-5:], sep="\n")
    return 0 if rise <= LARGEST and not any(lost.values()) and len(found.log) < LINES else 1


@dataclass(frozen=True)
class Soaked:
    """Time (s) since the first message and resident memory (MB) every second; samples sent, messages heard; the log."""

    memory: list[tuple[float, float]]
    sent: int
    heard: dict[str, int]
    log: list[str]


def soaked(rate: float, duration: float) -> Soaked:
    """One node with source and listener; what it did while messages came."""
    live = [sys.executable, str(Path(__file__).with_name("live.py"))]
    with tempfile.TemporaryFile("w+") as told, tempfile.TemporaryFile("w+") as counted, tempfile.TemporaryFile("w+") as log:
        node = subprocess.Popen([sys.executable, "-m", "boom_twin.ros.node.main"], stdout=log, stderr=log)
        listener = subprocess.Popen([*live, "listen", "boom_twin", "forget"], stdout=counted)
        source = subprocess.Popen([*live, "source", str(rate), str(duration), "even"], stdout=told)
        try:
            while not _text(told):
                if source.poll() is not None:
                    raise SystemExit(f"the node did not start:\n{_text(log)}")
                time.sleep(0.1)
            began, rows = time.monotonic(), []
            while source.poll() is None:
                if node.poll() is not None:
                    raise SystemExit(f"the node ended with {node.returncode}:\n{_text(log)}")
                rows.append((time.monotonic() - began, memory(node)))
                time.sleep(1.0)
            listener.terminate()
            listener.wait(60.0)
            sent = len(json.loads(_text(told).splitlines()[1])["sent"])
            return Soaked(rows, sent, json.loads(_text(counted)), _text(log).splitlines())
        finally:
            for process in (source, listener, node):
                process.kill()


def _text(file: TextIO) -> str:
    file.flush()
    return os.pread(file.fileno(), os.fstat(file.fileno()).st_size, 0).decode()


if __name__ == "__main__":
    sys.exit(main())
