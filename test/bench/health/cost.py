"""Processor time of the live twin with health and estimate, in percent of a core, over sessions of the benchmark.

    python test/bench/health/cost.py 552 906 --sessions out/health/sessions

Samples are taken one by one, as the node takes them; time is that of the thread, so other work on the machine hardly counts.
The first two seconds, in which kernels are loaded, are left out. `health`: the share of `HealthMonitor.judge` and all below it.
"""

from __future__ import annotations

import os
from argparse import ArgumentParser
from pathlib import Path
from time import thread_time
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import stored
from scenarios import scenario

from boom_twin import Twin
from boom_twin.health.baseline import Baseline
from boom_twin.health.monitor import HealthMonitor
from boom_twin.types import StrokeReading

START = 2_000_000_000  # ns


def cost(number: int, sessions: Path) -> tuple[float, float, float]:
    """Shares of a core in all and of health, and the longest update (s)."""
    each, spent = scenario(number), [0.0]
    judge = HealthMonitor.judge

    def watched(self: HealthMonitor, *args: Any) -> Any:
        start = thread_time()
        found = judge(self, *args)
        spent[0] += thread_time() - start
        return found

    HealthMonitor.judge = watched  # type: ignore[method-assign]
    twin, samples, longest = (
        Twin(each.model, baseline=Baseline(), reads=StrokeReading.DRIVE),
        stored.load_samples(sessions, each),
        0.0,
    )
    warm = next(i for i, sample in enumerate(samples) if sample.stamp >= stored.EPOCH + START)
    for sample in samples[:warm]:
        twin.update(sample)
    spent[0], begin = 0.0, thread_time()
    for sample in samples[warm:]:
        start = thread_time()
        twin.update(sample)
        longest = max(longest, thread_time() - start)
    whole, HealthMonitor.judge = thread_time() - begin, judge  # type: ignore[method-assign]
    seconds = (samples[-1].stamp - samples[warm].stamp) * 1e-9
    return whole / seconds, spent[0] / seconds, longest


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("numbers", type=int, nargs="+")
    parser.add_argument("--sessions", type=Path, default=Path("out/health/sessions"))
    args = parser.parse_args()
    for number in args.numbers:
        whole, health, longest = cost(number, args.sessions)
        each = scenario(number)
        seen = f"{each.scene or 'default'} {each.rate:g} Hz {'+'.join(each.streams)} {[str(load) for load in each.loads]}"
        faults = [str(fault) for fault in each.faults]
        print(
            f"{number} {whole:.1%} of a core, health {health:.1%}, longest update {1e3 * longest:.1f} ms: {seen} {faults}",
            flush=True,
        )
