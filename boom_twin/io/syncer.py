"""Has a file put on the disk by a thread of its own, so that the next messages need not wait for the disk."""

from __future__ import annotations

import os
import time
from queue import SimpleQueue
from threading import Thread


class Syncer:
    """Puts on the disk what was written; one request at a time.

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
        self._asked: float | None = None
        self._requests: SimpleQueue[tuple[int, int]] = SimpleQueue()
        Thread(target=self._run, name="sync", daemon=True).start()

    @property
    def waits(self) -> float:
        """For how long the disk has not answered, s."""
        asked = self._asked
        return 0.0 if asked is None else time.monotonic() - asked

    def ask(self, file: int, mark: int) -> None:
        """Put the file with that descriptor on the disk; passed over while the disk has not answered the last request."""
        if self._asked is None:
            self._asked = time.monotonic()
            self._requests.put((os.dup(file), mark))

    def _run(self) -> None:
        while True:
            file, mark = self._requests.get()
            try:
                os.fsync(file)
                self.done, self.time = mark, self._asked or self.time
            except OSError as error:
                self.error = error
            finally:
                os.close(file)
                self._asked = None
