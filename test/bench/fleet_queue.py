"""Simulate the queue of a fleet's sessions: how many cores a number of rigs needs, from measured costs.

Every rig records sessions of half an hour in its shift; each is a task when it ends. A scheduler hands out one task after
the other, a core does one at a time. Run: .venv/bin/python test/bench/fleet_queue.py --cost 60 --start 3 --overhead 0.016
"""

from __future__ import annotations

import argparse
from heapq import heapify, heapreplace

import numpy as np

DAY, SHIFT, SESSION = 86400.0, 8 * 3600.0, 1800.0
"""Seconds: a day, in which each rig works one shift, begun in the morning of its time zone; a session."""
PER_SHIFT = 12
"""Sessions of a rig in a shift: six hours of motion."""


def arrivals(rigs: int, zones: float, random: np.random.Generator) -> np.ndarray:
    """When sessions end in a day, s, ascending; shifts begin within `zones` hours of each other."""
    begin = random.uniform(0.0, zones * 3600.0, rigs)[:, None]
    within = np.sort(random.uniform(SESSION, SHIFT, (rigs, PER_SHIFT)), axis=1)
    return np.sort((begin + within).ravel())


def waits(times: np.ndarray, cores: int, service: np.ndarray, overhead: float) -> np.ndarray:
    """From the end of each session until its row is there, s: first the scheduler, then the first free core."""
    free, scheduler = [0.0] * cores, 0.0
    heapify(free)
    found = np.empty(len(times))
    for i, (time, cost) in enumerate(zip(times.tolist(), service.tolist(), strict=True)):
        scheduler = max(scheduler, time) + overhead
        end = max(scheduler, free[0]) + cost
        heapreplace(free, end)
        found[i] = end - time
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cost", type=float, required=True, help="core-seconds for an hour of session")
    parser.add_argument("--start", type=float, required=True, help="core-seconds for a session besides")
    parser.add_argument("--overhead", type=float, required=True, help="seconds of the scheduler for a task")
    parser.add_argument("--zones", type=float, default=4.0, help="hours within which shifts begin")
    args = parser.parse_args()
    random = np.random.default_rng(1)
    mean = args.cost * SESSION / 3600.0 + args.start
    print(f"{mean:.1f} core-seconds a session")
    for rigs in (10, 1000, 100_000):
        times = arrivals(rigs, args.zones, random)
        service = mean * random.uniform(0.7, 1.3, len(times))
        busy = len(times) * mean
        span = times[-1] - times[0]
        print(f"{rigs} rigs: {len(times)} sessions a day, {busy / 3600.0:.1f} core-hours a day; one scheduler's share "
              f"{len(times) * args.overhead / span:.1%}")  # fmt: skip
        for name, seconds in (("within the shifts", span), ("within the day", DAY)):
            cores = max(1, int(np.ceil(1.15 * busy / seconds)))
            found = waits(times, cores, service, args.overhead)
            told = ", ".join(f"{q} % {np.percentile(found, q) / 60.0:.1f}" for q in (50, 95, 100))
            print(f"  {cores} cores ({name}): minutes from the end of a session to its row: {told}")


if __name__ == "__main__":
    main()
