"""Has files put on the disk by a thread of its own, so that the next messages need not wait for the disk."""

from __future__ import annotations

import os
import time
from queue import SimpleQueue
from threading import Thread


class Syncer:
    """Puts on the disk what was written; asked by one thread.

    Attributes
    ----------
    done : int
        The mark of the newest request that is on the disk.
    time : float
        When that was asked for, s of `time.monotonic`.
    error : OSError or None
        Why the disk failed.
    """

    def __init__(self) -> None:
        self.done, self.time = 0, time.monotonic()
        self.error: OSError | None = None
        self._sent = self._answered = 0  # requests; each is changed by one thread only
        self._began = self.time
        self._requests: SimpleQueue[tuple[int, int, float]] = SimpleQueue()
        Thread(target=self._run, name="sync", daemon=True).start()

    @property
    def waits(self) -> float:
        """For how long the disk has not answered, s."""
        return time.monotonic() - self._began if self._answered < self._sent else 0.0

    def ask(self, file: int, mark: int) -> None:
        """Put the file with that descriptor on the disk; passed over while the disk has not answered all requests."""
        if self._answered == self._sent:
            self.put(file, mark)

    def put(self, file: int, mark: int) -> None:
        """The same, never passed over; the file may be closed at once."""
        now = time.monotonic()
        if self._answered == self._sent:
            self._began = now
        self._sent += 1
        self._requests.put((os.dup(file), mark, now))

    def drain(self) -> None:
        """Wait until the disk has answered all requests."""
        while self._answered < self._sent:
            time.sleep(0.005)

    def _run(self) -> None:
        while True:
            file, mark, asked = self._requests.get()
            self._began = time.monotonic()
            try:
                os.fsync(file)
                self.done, self.time = mark, asked
            except OSError as error:
                self.error = error
            finally:
                os.close(file)
                self._answered += 1
