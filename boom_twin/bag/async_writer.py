"""Write a bag in a thread of its own, and fsync in another, so that a slow disk holds up no message."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from math import inf
from queue import Empty, SimpleQueue
from shutil import disk_usage
from threading import Thread

from ..diagnostics.topic_status import DiskState
from ..errors import BagError
from .metadata import Recorded
from .writer import BagWriter


class Syncer:
    """Thread that calls ``fsync`` on files; requests come from one other thread.

    `done` is the mark of the newest request that is on the disk, and `time` (s of `time.monotonic`) that of this request.
    """

    def __init__(self) -> None:
        self.done, self.time = 0, time.monotonic()
        self.error: OSError | None = None  # error of the disk, if it failed
        self._sent = self._answered = 0  # requests; each is changed by one thread only
        self._began = self.time
        self._requests: SimpleQueue[tuple[int, int, float]] = SimpleQueue()
        Thread(target=self._run, name="sync", daemon=True).start()

    @property
    def waits(self) -> float:
        """Waiting time of the request that the disk works on, s; 0 without an open request."""
        return time.monotonic() - self._began if self._answered < self._sent else 0.0

    def ask(self, file: int, mark: int) -> None:
        """Request ``fsync`` of the file with this descriptor, unless an earlier request is still open."""
        if self._answered == self._sent:
            self.put(file, mark)

    def put(self, file: int, mark: int) -> None:
        """Request ``fsync`` of the file with this descriptor in any case. The caller may close the file at once."""
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


FLUSH = 0.25
"""Time between two flushes, s. A killed process loses at most the messages of that time."""
STALL = 5.0  # time without an answer of the disk before it is reported, s
PATIENCE = 30.0  # time for the disk to complete the bag at the end, s
MOST_WAITING = 256 * 2**20  # bytes of messages that may wait in memory

_Message = tuple[int, int, bytes, int, int]


class Storage:
    """Queue of messages in front of a bag; a thread writes them, so that a slow disk does not block the caller.

    Messages survive this process after `FLUSH` seconds. They survive a loss of power as soon as the disk has them. `tell`
    receives a sentence when the disk does not answer, and when it answers again. Only this object may use `bag` from now on.
    """

    def __init__(self, bag: BagWriter, tell: Callable[[str], None]) -> None:
        self._bag, self._tell = bag, tell
        self._queue: SimpleQueue[_Message | Recorded | None] = SimpleQueue()
        self._put = self._taken = 0  # bytes; each is changed by one thread only
        self._began = self._alive = time.monotonic()
        self._syncer = Syncer()
        bag.sync = lambda file: self._syncer.put(file, self._taken)
        self._free = self._written = 0
        self._is_late = False
        self._error: BaseException | None = None
        self._topics = 0
        self._thread = Thread(target=self._run, name="storage", daemon=True)
        self._thread.start()

    def add(self, topic: Recorded) -> int:
        """Register a topic and return its key for `put`."""
        self._queue.put(topic)
        self._topics += 1
        return self._topics - 1

    def put(self, key: int, log_time: int, data: bytes, publish_time: int, sequence: int) -> None:
        """Append one encoded message; times in ns."""
        self._put += len(data)
        self._queue.put((key, log_time, data, publish_time, sequence))

    def check(self) -> None:
        """Report a disk that does not answer, or that answers again.

        Raise BagError if the disk is full or fails, or too much waits for it.
        """
        if self._error is not None:
            raise self._error
        silent = max(time.monotonic() - self._alive, self._syncer.waits)
        if silent > STALL and not self._is_late:
            self._tell(f"{self._bag.directory}: the disk has not answered for {silent:.0f} s; messages wait in memory")
        elif silent < STALL and self._is_late:
            self._tell(f"{self._bag.directory}: the disk answers again; nothing was lost")
        self._is_late = silent > STALL
        if self._put - self._taken > MOST_WAITING:
            raise self._stalled(f"{MOST_WAITING // 2**20} MiB of messages wait in memory")

    def state(self) -> DiskState:
        """Return the state of the disk: delay, waiting and written bytes, free space and time until it is full."""
        now = time.monotonic()
        pace = self._written / (now - self._began)
        return DiskState(
            lag=now - self._syncer.time if self._put > self._syncer.done else 0.0,
            waiting=self._put - self._taken,
            written=self._written,
            free=self._free,
            left=self._free / pace if pace else inf,
        )

    def close(self) -> list[int]:
        """Complete the bag and return the number of written messages by key.

        Raise BagError if the disk is full or fails, or does not answer.
        """
        self._queue.put(None)
        self._thread.join(PATIENCE)
        if self._error is not None:
            raise self._error
        if self._thread.is_alive():
            raise self._stalled(f"it has not answered for {time.monotonic() - self._alive:.0f} s at the end")
        return [self._bag.counts[key] for key in range(self._topics)]

    def _stalled(self, how: str) -> BagError:
        return BagError(
            f"{self._bag.directory}: the disk does not keep up: {how}. Record less or on a faster disk. {self._rescue}"
        )

    def _run(self) -> None:
        try:
            self._serve()
            self._bag.close()
            self._syncer.drain()
            self._check_disk()
        except BagError as error:
            self._error = BagError(f"{error} {self._rescue}")
            self._bag.abandon()
        except Exception as error:  # told where it can be told: by `check` and `close`
            self._error = error
            self._bag.abandon()

    @property
    def _rescue(self) -> str:
        return f"`boom_twin recover {self._bag.directory} --out DIR` saves what was written before."

    def _serve(self) -> None:
        """Write messages until the end and flush every `FLUSH` seconds."""
        due = time.monotonic()
        while True:
            self._alive = time.monotonic()
            if self._alive >= due:
                self._flush()
                due = time.monotonic() + FLUSH
            try:
                item = self._queue.get(timeout=max(due - time.monotonic(), 0.0))
            except Empty:
                continue
            if item is None:
                return
            if isinstance(item, Recorded):
                self._bag.add(item)
            else:
                self._write(item)

    def _flush(self) -> None:
        """Flush the bag, request ``fsync`` and read the free space. A stalled disk blocks all three, so this thread does it."""
        self._syncer.ask(self._bag.flush(), self._taken)
        self._check_disk()
        self._written, self._free = self._bag.written, disk_usage(self._bag.directory).free

    def _check_disk(self) -> None:
        if self._syncer.error is not None:
            raise self._bag.fault(self._syncer.error)

    def _write(self, message: _Message) -> None:
        key, log_time, data, publish_time, sequence = message
        self._bag.write(key, log_time, data, publish_time, sequence)
        self._taken += len(data)
