"""Broken, hostile and absurd input, at random: ``PYTHONPATH=test python -m fuzz.run [--seconds 600] [--seed 1]``.

Two processes judge cases at a time. What is not wanted is kept in ``--out``, with the command that repeats it:
``python -m fuzz.run --target NAME --case PATH``. A case that ends its process, or never returns, is kept too.
"""

from __future__ import annotations

import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
import traceback
from argparse import ArgumentParser
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from shutil import rmtree
from types import ModuleType

import numpy as np

from .verdict import Kind, Verdict, table

ROOT = Path(__file__).parents[2]
SHARES = {"scenes": 0.4, "bags": 0.35, "messages": 0.25}
"""Targets with their shares of the time."""
TARGETS = tuple(SHARES)
WORKERS = 2
CASE_TIME = 30.0
"""Seconds of CPU that a case may take: 80 chunks that unpack to 60 MB each, read six times, take 10 on a busy machine."""
CASE_MEMORY = 2**30
"""Bytes by which the memory may grow in one case."""
GUARD = 4 * 2**30
"""Address space beyond what a worker has at first: a bomb is to be counted, not to take the machine down."""
START = 480.0
"""Seconds in which a worker begins, for it may compile, and ends its last case. The machine may have other work."""


def module(target: str) -> ModuleType:
    """Return the module of a target, with ``begin()``, ``make(random, path)`` and ``judge(path)``."""
    return import_module(f".{target}", __package__)


def judged(target: str, path: Path) -> Verdict:
    """Return the verdict on one case; exceptions, time and memory are judged here."""
    before = _memory("VmRSS")
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # forgets the peak
    try:
        with _limited():
            verdict = module(target).judge(path)
    except _Hang:
        return Verdict(Kind.HANG, traceback.format_exc())
    except MemoryError:
        return Verdict(Kind.GROWTH, "MemoryError")
    except Exception:
        return Verdict(Kind.TRACEBACK, traceback.format_exc())
    grown = _memory("VmHWM") - before
    return Verdict(Kind.GROWTH, f"{grown >> 20} MiB") if grown > CASE_MEMORY else verdict


class _Hang(BaseException):
    """The time is over; no handler of exceptions is to take it for one."""


@contextmanager
def _limited() -> Iterator[None]:
    def stop(*_: object) -> None:
        raise _Hang

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, CASE_TIME)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def _memory(name: str) -> int:
    """Return bytes by ``/proc/self/status``."""
    found = re.search(rf"{name}:\s*(\d+)", Path("/proc/self/status").read_text(encoding="ascii"))
    assert found is not None
    return int(found[1]) * 1024


def work(target: str, seconds: float, seed: int, number: int, out: Path) -> None:
    """Judge every `WORKERS`-th case from `number` on; print the counts. Cases are the same for the same seed and number."""
    stdout, sys.stdout = sys.stdout, sys.stderr  # what the judged code prints is not a count
    module(target).begin()
    resource.setrlimit(resource.RLIMIT_AS, (_memory("VmSize") + GUARD,) * 2)
    counts, end = Counter[str](), time.monotonic() + seconds
    while not counts or time.monotonic() < end:
        folder = out / f"{target}_{seed}_{number}"
        rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        path = module(target).make(np.random.default_rng((seed, TARGETS.index(target), number)), folder / folder.name)
        command = f"PYTHONPATH=test python -m fuzz.run --target {target} --case {path}"
        (folder / "finding.txt").write_text(f"{command}\nended the process, or never returned\n")
        verdict = judged(target, path)
        counts[verdict.kind] += 1
        if verdict.is_finding:
            (folder / "finding.txt").write_text(f"{command}\n{verdict.kind}\n{verdict.words}\n", encoding="utf-8")
            print(f"{verdict.kind}: {command}\n  {verdict.words.strip()[-300:]}", file=sys.stderr)
        else:
            rmtree(folder)
        number += WORKERS
    print(json.dumps(counts), file=stdout)


def fuzz(target: str, seconds: float, seed: int, out: Path) -> Counter[str]:
    """Return the counts of the verdicts on the cases of one target, judged for so long."""
    command = [sys.executable, "-m", "fuzz.run", "--target", target, "--seed", str(seed), "--out", str(out)]
    options = {"stdout": subprocess.PIPE, "cwd": ROOT, "start_new_session": True}
    env = {**os.environ, "PYTHONPATH": str(ROOT / "test")}
    places = (["--seconds", str(seconds), "--worker", str(place)] for place in range(WORKERS))
    workers = [subprocess.Popen(command + place, env=env, **options) for place in places]
    counts = Counter[str]()
    try:
        for worker in workers:
            try:
                told, _ = worker.communicate(timeout=START + seconds)
                counts.update(json.loads(told) if worker.returncode == 0 else {Kind.TRACEBACK: 1})
            except subprocess.TimeoutExpired:
                counts[Kind.HANG] += 1
    finally:
        for worker in workers:
            with suppress(ProcessLookupError):
                os.killpg(worker.pid, signal.SIGKILL)  # with all that it started
            worker.wait()
    return counts


def main() -> int:
    """Fuzz, print the table; 1 if there was a finding."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--target", nargs="+", choices=TARGETS, default=list(TARGETS))
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "fuzz", help="where findings are kept")
    parser.add_argument("--case", type=Path, help="judge this one of --target, in this process")
    parser.add_argument("--worker", type=int, help="begin with this case of --target, in this process")
    args = parser.parse_args()
    if args.case is not None:
        module(args.target[0]).begin()
        verdict = judged(args.target[0], args.case)
        print(f"{verdict.kind}: {verdict.words}")
        return int(verdict.is_finding)
    if args.worker is not None:
        work(args.target[0], args.seconds, args.seed, args.worker, args.out)
        return 0
    whole = sum(SHARES[each] for each in args.target)
    counts = {each: fuzz(each, args.seconds * SHARES[each] / whole, args.seed, args.out.resolve()) for each in args.target}
    print(table(counts))
    return int(any(Kind(kind).is_finding for found in counts.values() for kind in found))


if __name__ == "__main__":
    sys.exit(main())
