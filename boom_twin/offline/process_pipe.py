"""Pipe between processes: a module of this package run as a child process, with pickled batches on stdin and stdout.

A replay reads, steps and writes; on two cores its ends can run beside the stepping. Every process has one reader and one
writer, so order and bytes are those of doing it all in one place.
"""

from __future__ import annotations

import fcntl
import gc
import os
import pickle
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import IO, Any

from ..errors import BagError
from ..system.child_process import python_command

ROOM = 2**20
"""Bytes that a pipe may hold: a few batches, so that neither end waits for the other's next turn; no user may ask for more."""
READY = "ready"
"""First thing a process sends: its imports are done."""
END = "end"
"""Last thing that is sent, either way: without it, what came is not all, because its sender was killed."""


class Pipe:
    """Pipe to a child process: start a module with its arguments, send to it, receive from it.

    Parameters
    ----------
    module : str
    arguments : str
    inherited : sequence of int, optional
        Descriptors that stay open in the process; a lock so lasts until both ends have gone.

    Raises
    ------
    BagError
        From any method, when the process ended with an error; its text is what the process said.
    """

    def __init__(self, module: str, *arguments: str, inherited: Sequence[int] = ()) -> None:
        pipe = subprocess.PIPE
        command = python_command(module, *arguments)
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, pass_fds=inherited)
        self._stdin, self._stdout = self._process.stdin, self._process.stdout
        for end in (self._stdin, self._stdout):
            assert end is not None
            _make_roomy(end)

    def wait_ready(self) -> None:
        """Wait until the process has its imports done."""
        next(self.receive())

    def send(self, item: Any) -> None:
        """Send one object down the pipe."""
        assert self._stdin is not None
        try:
            _write(self._stdin.fileno(), item)
        except BrokenPipeError:
            self.finish()
            raise

    def receive(self) -> Iterator[Any]:
        """Yield everything that comes up the pipe until its end is sent."""
        assert self._stdout is not None
        try:
            yield from received(self._stdout)
        except BagError:
            self.finish()  # which has the reason, if the process told one
            raise

    def finish(self) -> None:
        """Close the pipe, wait for the process to end, and raise its error if it reported one."""
        told = self._ended()
        if self._process.returncode != 0:
            text = told.decode(errors="replace").strip()
            if self._process.returncode != 1 or not text:
                text = (text.splitlines() or ["a process of the replay was ended from outside. Run it again."])[-1]
            raise BagError(text)

    def stop(self) -> None:
        """End the process at once, whatever it is doing."""
        self._process.kill()
        self._ended()

    def _ended(self) -> bytes:
        """Close the pipe, wait for the process to end, and return its stderr.

        Output that it would still send is dropped. After a failure that may be gigabytes; the closed pipe ends the process.
        """
        for end in (self._stdin, self._stdout):
            assert end is not None
            end.close()
        stderr = self._process.stderr
        assert stderr is not None
        told = b"" if stderr.closed else stderr.read()
        stderr.close()
        self._process.wait()
        return told


def _make_roomy(end: IO[bytes]) -> None:
    """Let a pipe hold `ROOM` bytes, if the system can do that and allows it."""
    if hasattr(fcntl, "F_SETPIPE_SZ"):
        with suppress(OSError):
            fcntl.fcntl(end, fcntl.F_SETPIPE_SZ, ROOM)


def received(stream: IO[bytes]) -> Iterator[Any]:
    """Yield the objects that come through a pipe, up to its end.

    Raises
    ------
    BagError
        The pipe broke off before: the process at its other end was ended by force.
    """
    while True:
        try:
            item = pickle.load(stream)
        except (EOFError, pickle.UnpicklingError):
            raise BagError("incomplete: a process of the replay was ended from outside. Run it again.") from None
        if isinstance(item, str) and item == END:
            return
        yield item


def say_ready() -> None:
    """Send the ready message from the process; the garbage collector skips its present objects, also at the exit."""
    gc.freeze()
    post([READY])


def post(items: list[Any]) -> None:
    """Send objects up the pipe; called by the process."""
    for item in items:
        _write(sys.stdout.fileno(), item)


def _write(descriptor: int, item: Any) -> None:
    """Write all of an object. Python's buffered writer loses what a suspended process (Ctrl-Z) had begun to write."""
    left = memoryview(pickle.dumps(item, protocol=pickle.HIGHEST_PROTOCOL))
    while left:
        left = left[os.write(descriptor, left) :]
