"""Child processes: the command line of one that runs a module of this package only, and a copy of this process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .cores import usable_cores

ROOT = Path(__file__).absolute().parents[2]  # folder or zip archive from which this process imported ``boom_twin``

_START = (
    "import runpy, sys; from importlib import machinery, util; "
    "spec = machinery.PathFinder.find_spec('boom_twin', [sys.argv[1]]); "
    "sys.modules['boom_twin'] = package = util.module_from_spec(spec); spec.loader.exec_module(package); "
    "module = sys.argv[2]; del sys.argv[1:3]; runpy.run_module(module, run_name='__main__', alter_sys=True)"
)


def python_command(module: str, *arguments: str) -> list[str]:
    """Return the command line that runs `module` of this package as ``python -m``, without the working directory's modules.

    ``python -m`` puts the working directory first on ``sys.path``, so that a ``numpy.py`` beside a received session would run;
    ``-P`` keeps it away. Environment and working directory are the parent's, so relative paths mean the same. The package is
    taken from where the parent has it, also where the parent alone knows that place (a changed ``sys.path``).
    """
    return [sys.executable, "-P", "-c", _START, str(ROOT), module, *arguments]


def end_process(process: subprocess.Popen[Any], timeout: float, by: signal.Signals = signal.SIGTERM) -> None:
    """End a child process by a signal and wait for its end. After `timeout` (s) it is killed."""
    process.send_signal(by)
    try:
        process.wait(timeout)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


@contextmanager
def beside(work: Callable[[], None]) -> Iterator[None]:
    """Do `work`, which writes files, in a copy of this process while the block runs.

    It is done here, after the block, if the copy failed; also with a single core, or with threads, which a copy would lack.
    """
    if sys.platform != "linux" or usable_cores() < 2 or threading.active_count() > 1:
        yield
        work()
        return
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            work()
            code = 0
        finally:
            os._exit(code)
    try:
        yield
    finally:
        _, status = os.waitpid(pid, 0)
    if status:
        work()
