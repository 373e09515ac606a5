"""Call a function in a child process, so that its Python code does not hold the interpreter's lock of this one."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import weakref
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from ..errors import BoomTwinError
from .processes import LESS_URGENT, collect_rarely, python_command


class ChildEndedError(BoomTwinError):
    """A child process has ended."""


class ChildCall:
    """Callable that `make` returns for its arguments, made and called in a child process. Everything passed is pickled.

    A call blocks its thread only. `close` kills the child, as the end of this object does. It also ends with its standard
    input: with this process. It gives way to other processes unless it `is_urgent`.
    """

    def __init__(self, make: Callable[..., Callable[..., Any]], *arguments: Any, is_urgent: bool = False) -> None:
        command = python_command("boom_twin.system.child_call")
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.close = weakref.finalize(self, _end, self._process, os.getpid())
        self._send(0 if is_urgent else LESS_URGENT)
        self._send((make, arguments))

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Return what the call gives; raise what it raises, or ChildEndedError."""
        assert self._process.stdout is not None
        try:
            self._send((arguments, named))
            error, found = pickle.load(self._process.stdout)
        except (EOFError, OSError, ValueError) as ended:  # ValueError: its pipes are closed
            raise ChildEndedError(f"a child process ended with code {self._process.wait()}") from ended
        if error is not None:
            raise error
        return found

    def _send(self, found: Any) -> None:
        assert self._process.stdin is not None
        pickle.dump(found, self._process.stdin)
        self._process.stdin.flush()


def _end(process: subprocess.Popen[bytes], owner: int) -> None:
    """End a child of the process `owner`; a fork of that has a copy of the object, and leaves the child alone."""
    if os.getpid() != owner:
        return
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        assert pipe is not None
        with suppress(OSError):  # what it holds for a child that is gone
            pipe.close()


def _serve() -> None:
    """Answer the calls that arrive on standard input. What is printed goes to standard error."""
    for stop in (signal.SIGINT, signal.SIGHUP):  # sent to all processes of a terminal
        signal.signal(stop, signal.SIG_IGN)
    collect_rarely()
    calls, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    os.nice(pickle.load(calls))
    make, arguments = pickle.load(calls)
    call = make(*arguments)
    with suppress(EOFError, BrokenPipeError):
        while True:
            (arguments, named), error, found = pickle.load(calls), None, None
            try:
                found = call(*arguments, **named)
            except Exception as raised:
                error = raised
            pickle.dump((error, found), answers)
            answers.flush()


if __name__ == "__main__":
    _serve()
