"""Start of a ROS process: signal handling, and a clear error where rclpy is missing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from importlib.util import find_spec
from types import FrameType

from ..errors import UsageError
from ..system.child_process import python_command

STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that end a process. SIGHUP comes when its terminal is closed, and is ignored under ``nohup``."""


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
    """Interruption of a piece of work that took too long to end by itself.

    A class of its own: a KeyboardInterrupt proper that passes through ``exec`` of a text, as dataclasses are made by, lets
    Python end the process as killed by SIGINT even where it was caught.
    """


def _interrupt(number: int, frame: FrameType | None) -> None:
    sys.unraisablehook = _nothing  # a finaliser of what was being made just now would tell of what it lacks
    raise InterruptedWorkError


def _nothing(unraisable: object) -> None:
    """Report nothing."""


class StopSignal:
    """Stop by one of `STOPS`: seen between two pieces of work, or KeyboardInterrupt if one takes too long.

    An exception in the midst of a callback is reported by rclpy as a fault of the callback. Python handles a signal between two
    of its instructions, and compiling has some that take seconds: a thread, which runs meanwhile, ends a process that goes on.
    So this is for one that holds nothing which could be lost.

    Attributes
    ----------
    asked : bool
        Whether a signal came.
    """

    LONGEST = 0.5
    """Time (s) for a piece of work to come to its end."""
    LAST = 1.7
    """Time (s) after which the process is ended, if it has not come to its end by itself."""

    def __init__(self) -> None:
        self.asked = False
        reading, writing = os.pipe()
        os.set_blocking(writing, False)
        signal.set_wakeup_fd(writing, warn_on_full_buffer=False)  # written to as soon as a signal comes, whatever Python does
        threading.Thread(target=self._end, args=(reading,), daemon=True).start()
        on_stop_signal(self._ask)

    def _ask(self) -> None:
        self.asked = True
        signal.signal(signal.SIGALRM, _interrupt)
        signal.setitimer(signal.ITIMER_REAL, self.LONGEST)

    def _end(self, reading: int) -> None:
        while os.read(reading, 1)[0] not in STOPS:
            pass
        time.sleep(self.LAST)
        os.write(sys.stderr.fileno(), b"stopped in the midst of its work\n")
        os._exit(0)

    def over(self) -> None:
        """Interrupt nothing from now on, because the process is ending."""
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def require_rclpy() -> None:
    """Raise UsageError, with the remedy, where rclpy is not installed, or has not the middleware that is asked for.

    A middleware that is not there ends the process that imports rclpy, so another one tries that.
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
