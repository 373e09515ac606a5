"""Judges cases one by one in a process of its own; one line of JSON before each and one after.

``python -m fuzz.worker TARGET SEED FIRST STEP FOLDER`` makes and judges the cases FIRST, FIRST + STEP, .. until it is ended.
"""

from __future__ import annotations

import json
import re
import resource
import signal
import sys
import tempfile
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

from .verdict import Kind, Verdict

TARGETS = ("scenes", "bags", "messages", "page")
LONGEST = 10.0
"""Seconds of a processor that a case may take."""
MOST = 2**30
"""Bytes by which the memory may grow in one case."""
GUARD = 4 * 2**30
"""Address space beyond what the worker has at first: a bomb is to be counted, not to take the machine down."""


def module(target: str) -> ModuleType:
    """The module of a target, with ``make(random, path)`` and ``judge(path)``."""
    return import_module(f".{target}", __package__)


def make(target: str, seed: int, number: int, folder: Path) -> Path:
    """Write one case into `folder`; the same for the same seed and number."""
    random = np.random.default_rng((seed, TARGETS.index(target), number))
    found: Path = module(target).make(random, folder / f"{target}_{seed}_{number}")
    return found


def judged(target: str, path: Path) -> Verdict:
    """The verdict on one case, an exception and memory among them."""
    before = _memory("VmRSS")
    _forget_peak()
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
    return Verdict(Kind.GROWTH, f"{grown >> 20} MiB") if grown > MOST else verdict


class _Hang(BaseException):
    """The time is over; no handler of exceptions is to take it for one."""


@contextmanager
def _limited() -> Iterator[None]:
    """Raise `_Hang` after `LONGEST`; `fuzz.run` ends a worker that waits, or in which that does not help."""

    def stop(*_: object) -> None:
        raise _Hang

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def _memory(name: str) -> int:
    """Bytes by ``/proc/self/status``."""
    found = re.search(rf"{name}:\s*(\d+)", Path("/proc/self/status").read_text(encoding="ascii"))
    assert found is not None
    return int(found[1]) * 1024


def _forget_peak() -> None:
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def _work(target: str, seed: int, number: int, step: int, folder: Path) -> None:
    out = sys.stdout
    sys.stdout = sys.stderr  # what the judged code prints is not a verdict
    module(target).begin()
    resource.setrlimit(resource.RLIMIT_AS, (_memory("VmSize") + GUARD,) * 2)
    while True:
        with tempfile.TemporaryDirectory(dir=folder) as place:
            path = make(target, seed, number, Path(place))
            print(json.dumps({"begins": number}), file=out, flush=True)
            verdict = judged(target, path)
        print(json.dumps({"number": number, "kind": verdict.kind, "words": verdict.words}), file=out, flush=True)
        number += step


if __name__ == "__main__":
    _work(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]), Path(sys.argv[5]))
