"""A module of this package run as a process of its own, with pickled batches on its stdin and stdout.

A replay reads, steps and writes; on two cores its ends can run beside the stepping. Every process has one reader and one
writer, so order and bytes are those of doing it all in one place.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

from ..child_process import python_command
from ..errors import BagError

READY = "ready"
"""First thing a process sends: its imports are done."""


class Pipe:
    """The replay's end: start a module with its arguments, send to it, receive from it.

    Raises
    ------
    BagError
        From any method, when the process ended with an error; its text is what the process said.
    """

    def __init__(self, module: str, *arguments: str) -> None:
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(python_command(module, *arguments), stdin=pipe, stdout=pipe, stderr=pipe)
        self._stdin, self._stdout = self._process.stdin, self._process.stdout

    def wait_ready(self) -> None:
        """Until the process has its imports done."""
        if next(self.receive(), None) != READY:
            self.finish()
            raise BagError("a process of the replay ended before it began. Run it again.")

    def send(self, item: Any) -> None:
        """One object down the pipe."""
        assert self._stdin is not None
        try:
            pickle.dump(item, self._stdin, protocol=pickle.HIGHEST_PROTOCOL)
            self._stdin.flush()
        except BrokenPipeError:
            self.finish()
            raise

    def receive(self) -> Iterator[Any]:
        """Everything that comes up the pipe until it ends."""
        assert self._stdout is not None
        while True:
            try:
                yield pickle.load(self._stdout)
            except EOFError:
                return

    def finish(self) -> None:
        """Close the pipe, wait for the process to end, and raise what it had to say if that was an error."""
        _, told = self._process.communicate()
        if self._process.returncode != 0:
            text = told.decode(errors="replace").strip()
            if self._process.returncode != 1 or not text:
                text = (text.splitlines() or ["a process of the replay was ended from outside. Run it again."])[-1]
            raise BagError(text)

    def stop(self) -> None:
        """End the process at once, whatever it is doing."""
        self._process.kill()
        self._process.communicate()


def say_ready() -> None:
    """Called by the process."""
    post([READY])


def post(items: list[Any]) -> None:
    """Send objects up the pipe; called by the process."""
    for item in items:
        pickle.dump(item, sys.stdout.buffer, protocol=pickle.HIGHEST_PROTOCOL)
    sys.stdout.buffer.flush()
