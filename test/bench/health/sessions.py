"""Makes the sessions of the health benchmark with the virtual rig, on all cores; goes on where it was stopped.

    python test/bench/health/sessions.py [--out out/health/sessions] [--jobs 2] [--first 100]

Every motion is simulated once; sensor faults are put on the motions of healthy tests. Six elements a section, exact at their
nodes, with steps of 5 ms at a tolerance of 1e-4 agree with 16 elements and 0.5 ms (20 s of random moves) within 8e-6 rad rms in
every joint, 0.09 mm and 0.007 m/s^2 at the tip: a twentieth of the noise of the angle sensors, a seventh of the IMU's. They
take 35 ms of one core for a second of a session. Pins with play take 2 ms and a tangent of their own in every pass.
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
from plan import INSTANCES, Job, instance, jobs

from boom_twin.errors import SolverError
from boom_twin.scene import load_scene
from boom_twin.scene.edit import parameter, parameter_names
from boom_twin.validation.rig import Programme, RigSession, Scheme, Sensors, at_rest, move, observe, random_programme
from boom_twin.validation.rig.faults import spoil
from boom_twin.validation.rig.faulty_boom import with_faults

ELEMENTS, STEP, SCHEME = 6, 5e-3, Scheme(tolerance=1e-4)
STEP_OF_PLAY, SCHEME_OF_PLAY = 2e-3, Scheme(kept=0)
NICE = 10
AT_ONCE = 20  # sessions of one process: what Exudyn does not give back, its end does


def simulated(job: Job) -> dict[str, np.ndarray]:
    """The session of one motion, as arrays."""
    boom = with_faults(instance(job.instance), [] if job.fault is None else [job.fault])
    programme = random_programme(load_scene(), job.posture, job.duration, job.seed)
    resting = at_rest(boom, np.array(programme.first), ELEMENTS, nodally_exact=True)
    step, scheme = (STEP_OF_PLAY, SCHEME_OF_PLAY) if resting.boom.bushes else (STEP, SCHEME)
    rows, _ = move(resting, programme, job.duration, step, step, scheme)
    session = observe(boom, programme, rows, Sensors(), job.seed)
    return {**_arrays(session), **_programme_arrays(programme)}


def spoilt(job: Job, healthy: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The first part of a healthy session with a sensor fault."""
    times = (healthy["stamps"] - stored.EPOCH) * 1e-9
    kept = times < job.duration
    part = {name: values if name in ("first", "moves") else values[kept] for name, values in healthy.items()}
    truth = {name.removeprefix("true_"): values for name, values in part.items() if name.startswith("true_")}
    names = ("stamps", "strokes", "joints", "imu", "angle_stamps", "forces")
    session = RigSession(*(part[name] for name in names), truth | {"t": times[kept]})
    return part | _arrays(spoil(session, [job.fault], job.seed))


def make(job: Job, folder: Path) -> str:
    """Make the file of one session unless it is there; gives what went wrong, or nothing."""
    path = folder / job.file
    if path.is_file():
        return ""
    try:
        stored.save(path, simulated(job) if job.base is None else spoilt(job, _base(job.base, folder)))
    except SolverError as failure:
        return f"{job.file}: {failure}"
    return ""


def make_all(folder: Path, processes: int, first: int | None) -> None:
    """Make what is missing, in order, and keep the index true."""
    folder.mkdir(parents=True, exist_ok=True)
    parameters = {i: {name: parameter(instance(i), name) for name in parameter_names(instance(i))} for i in (0, *INSTANCES)}
    stored.save_json(folder / "instances.json", parameters)
    todo = jobs()[:first]
    done: list[dict] = []
    with Pool(processes, os.nice, (NICE,), AT_ONCE) as pool:
        for job, failure in zip(todo, pool.imap(partial(make, folder=folder), todo), strict=True):
            if failure:
                print(failure, file=sys.stderr, flush=True)
                continue
            done.append(job.entry)
            stored.save_json(folder / stored.INDEX, done)
            print(f"{len(done)} of {len(todo)}: {job.file}", flush=True)


def _base(job: Job, folder: Path) -> dict[str, np.ndarray]:
    """The healthy session; made here where another process is not yet done with it."""
    path = folder / job.file
    return stored.load(path) if path.is_file() else simulated(job)


def _arrays(session: RigSession) -> dict[str, np.ndarray]:
    truth = {f"true_{name}": values.astype(np.float32) for name, values in session.truth.items() if name != "t"}
    read = {name: getattr(session, name) for name in ("stamps", "angle_stamps", "strokes", "joints", "imu", "forces")}
    return read | truth


def _programme_arrays(programme: Programme) -> dict[str, np.ndarray]:
    moves = [(move.cylinder, move.start, move.duration, move.target) for move in programme.moves]
    return {"first": np.array(programme.first), "moves": np.array(moves, float).reshape(-1, 4)}


def main() -> None:
    """Arguments, then the work."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/health/sessions"))
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)), help="processes")
    parser.add_argument("--first", type=int, help="only so many sessions")
    args = parser.parse_args()
    make_all(args.out, args.jobs, args.first)


if __name__ == "__main__":
    main()
