"""Start of a ROS process: signal handling, and a clear error where rclpy is missing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from importlib.util import find_spec
from types import FrameType

from ..errors import UsageError
from ..system.processes import python_command

STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that end a process. A closed terminal sends SIGHUP; ``nohup`` ignores it."""

PREPARATION = "preparation"
"""Name of the thread that prepares a node's model."""


def stop_signals() -> tuple[signal.Signals, ...]:
    """Return the signals of `STOPS` that this process handles; SIGHUP is left out if it is ignored."""
    return tuple(each for each in STOPS if each is not signal.SIGHUP or signal.getsignal(each) is not signal.SIG_IGN)


def on_stop_signal(act: Callable[[], None]) -> None:
    """Call `act` at the first of `STOPS`, and ignore further ones."""

    def stop(number: int, frame: FrameType | None) -> None:
        for each in STOPS:
            signal.signal(each, signal.SIG_IGN)
        act()

    for each in stop_signals():
        signal.signal(each, stop)


class InterruptedWorkError(KeyboardInterrupt):
    """Interruption of work that took too long to end by itself.

    It is a subclass because a plain KeyboardInterrupt inside ``exec`` (dataclasses use it) ends the process as killed by
    SIGINT, even if it is caught.
    """


def _interrupt(number: int, frame: FrameType | None) -> None:
    sys.unraisablehook = _nothing  # finalisers of half-made objects would print errors
    raise InterruptedWorkError


def _nothing(unraisable: object) -> None:
    """Report nothing."""


class StopSignal:
    """Stop request by one of `STOPS`: checked between callbacks; KeyboardInterrupt if a callback takes too long.

    rclpy reports an exception inside a callback as a fault of the callback. Use this only in a process without unsaved data.
    """

    LONGEST = 0.5  # time (s) allowed to a callback before it is interrupted

    def __init__(self) -> None:
        self.asked = False  # True after a signal
        on_stop_signal(self._ask)

    def _ask(self) -> None:
        self.asked = True
        signal.signal(signal.SIGALRM, _interrupt)
        signal.setitimer(signal.ITIMER_REAL, self.LONGEST)

    def over(self) -> None:
        """Interrupt nothing from now on, because the process is ending."""
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def end_with_preparation(code: int) -> int:
    """Return the exit code; if the thread `PREPARATION` still works, end the process with it here.

    Python does not wait for this daemon thread. The compiler in it would crash while its library is unloaded.
    """
    if any(each.name == PREPARATION for each in threading.enumerate()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    return code


def require_rclpy() -> None:
    """Raise UsageError with the remedy if rclpy or the requested middleware is not installed.

    Importing rclpy without its middleware ends the process. So a child process tries it.
    """
    if find_spec("rclpy") is None:
        raise UsageError(
            'rclpy is not installed, and this needs ROS 2. Run `pip install "boom_twin[ros]"`, '
            "or source the setup file of a ROS 2 Jazzy installation."
        )
    if name := os.environ.get("RMW_IMPLEMENTATION"):
        command = python_command("rclpy.impl.implementation_singleton")
        if subprocess.run(command, capture_output=True, check=False).returncode:
            told = "rclpy cannot load this middleware. Install its package, or unset the variable."
            raise UsageError(f"RMW_IMPLEMENTATION={name}: {told}")
