"""Command line of a child process that runs a module of this package, and nothing from the working directory."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).absolute().parents[2]
"""Folder or zip archive from which this process imported ``boom_twin``."""

_START = (
    "import runpy, sys; from importlib import machinery, util; "
    "spec = machinery.PathFinder.find_spec('boom_twin', [sys.argv[1]]); "
    "sys.modules['boom_twin'] = package = util.module_from_spec(spec); spec.loader.exec_module(package); "
    "module = sys.argv[2]; del sys.argv[1:3]; runpy.run_module(module, run_name='__main__', alter_sys=True)"
)


def python_command(module: str, *arguments: str) -> list[str]:
    """Return the command line that runs `module` of this package as ``python -m``, without the working directory's modules.

    ``python -m`` puts the working directory first on ``sys.path``, so that a ``numpy.py`` beside a received session would
    run; ``-P`` keeps it away. Environment and working directory are the parent's, so relative paths mean the same. The
    package is taken from where the parent has it, also where the parent alone knows that place (a changed ``sys.path``).

    Parameters
    ----------
    module : str
        Full name, such as ``boom_twin.cli.main``.
    *arguments : str
        Arguments of the module.
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
