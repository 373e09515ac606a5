"""Makes the sessions of the health benchmark with the virtual rig; goes on where it was stopped.

    python test/bench/health/sessions.py --out out/health/sessions --count 100 [--jobs 2]
    python test/bench/health/sessions.py --out out/health/sessions --only 720 753 [--jobs 2]

Six elements a section, exact at their nodes, with steps of 5 ms at a tolerance of 1e-4 agree with 16 elements and 0.5 ms (20 s
of random moves) within 8e-6 rad rms in every joint, 0.09 mm and 0.007 m/s^2 at the tip: a twentieth of the noise of the angle
sensors, a seventh of the IMU's. They take 35 ms of one core for a second of a session.
"""

from __future__ import annotations

import argparse
import os
import sys
from functools import partial
from multiprocessing import Pool
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one process per core; and files repeat bit for bit

import numpy as np
import stored
from scenarios import Scenario, learning, scenario

from boom_twin.errors import SolverError
from boom_twin.validation.rig import Scheme, at_rest, move, observe, random_programme
from boom_twin.validation.rig.faults import spoil
from boom_twin.validation.rig.faulty_boom import changes
from boom_twin.validation.rig.loads import tip_load
from boom_twin.validation.rig.motion import Programme

ELEMENTS, STEP, SCHEME = 6, 5e-3, Scheme(tolerance=1e-4)
NICE = 10
AT_ONCE = 20  # sessions of one process: what Exudyn does not give back, its end does


def simulated(each: Scenario, programme: Programme | None = None) -> dict[str, np.ndarray]:
    """The readings of one session, as arrays; of random moves unless there is a programme."""
    start, changing = changes(each.boom, each.faults)
    programme = programme or random_programme(each.model, each.posture, each.duration, each.seed)
    load = tip_load(start, each.loads, each.duration, each.seed) if each.loads else None
    resting = at_rest(start, np.array(programme.first), ELEMENTS, nodally_exact=True)
    rows, _ = move(resting, programme, each.duration, STEP, STEP, SCHEME, load, changing)
    session = observe(start, programme, rows, each.sensors, each.seed, load)
    session = spoil(session, each.faults, each.seed)
    return {name: getattr(session, name) for name in stored.ARRAYS}


def make(each: Scenario, folder: Path) -> str:
    """Make the file of one session unless it is there; gives what went wrong, or nothing."""
    path = stored.path_of(folder, each)
    if path.is_file():
        return ""
    try:
        stored.save(path, simulated(each))
    except SolverError as failure:
        return f"{path.name}: {failure}"
    return ""


def main() -> None:
    """Arguments, then the work."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/health/sessions"))
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)), help="processes")
    parser.add_argument("--count", type=int, default=1000, help="sessions beside those that baselines are learnt from")
    parser.add_argument("--first", type=int, default=0, help="number of the first of them")
    parser.add_argument("--only", type=int, nargs="*", help="numbers, instead of all from the first on")
    args = parser.parse_args()
    numbers = args.only or range(args.first, args.first + args.count)
    wanted = [*map(scenario, numbers)]
    others = sorted({each.scene for each in wanted} - {""})
    todo = [*learning(), *(each for scene in others for each in learning(scene)), *wanted]
    with Pool(args.jobs, os.nice, (NICE,), AT_ONCE) as pool:
        for done, failure in enumerate(pool.imap(partial(make, folder=args.out), todo), 1):
            print(failure or f"{done} of {len(todo)}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
