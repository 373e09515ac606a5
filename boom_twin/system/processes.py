"""Processes: command line of a child that runs a module of this package only, a copy of this process, cores, BLAS threads."""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from subprocess import Popen


LESS_URGENT = 15  # added niceness beside a live node: 36 / (36 + 1024) of a core that another process would use alone
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


def end_process(process: Popen[Any], timeout: float, by: signal.Signals = signal.SIGTERM) -> None:
    """End a child process by a signal and wait for its end. After `timeout` (s) it is killed."""
    from subprocess import TimeoutExpired

    process.send_signal(by)
    try:
        process.wait(timeout)
    except TimeoutExpired:
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


@contextmanager
def quick_switches() -> Iterator[None]:
    """Shorten the switch interval of threads, so that the twin does not wait for another one's Python code.

    Each of its calls that lets go of the interpreter's lock, such as a kernel or a published message, waits for it afterwards.
    """
    usual = sys.getswitchinterval()
    sys.setswitchinterval(2e-5)  # s that a thread keeps the interpreter's lock; a call of the twin's kernel takes 1 ms
    try:
        yield
    finally:
        sys.setswitchinterval(usual)


def usable_cores() -> int:
    """Return the number of cores that this process may use; if the system does not give it, the number of the machine."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def collect_rarely() -> None:
    """Let 300 000 new objects come before a garbage collection, which takes 0.05 s among the modules of numba or matplotlib."""
    gc.set_threshold(300_000)


def use_one_blas_thread() -> None:
    """Let OpenBLAS work on one thread, unless the environment says otherwise; before numpy is imported.

    Threads slow small matrices down ten times and more, and their number changes the last bits of products of larger ones: a
    live node and a replay of its session must not differ by the computers they ran on. What runs on several cores here does so
    as processes.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
