"""Costly inputs of tests, made once in a run of the tests and shared by all its worker processes."""

from __future__ import annotations

import fcntl
import os
import pickle
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

Value = TypeVar("Value")


class MadeOnce:
    """The first process that wants a thing makes it, under a lock; the others wait, then read it from this run's `store`.

    What is handed out is the caller's own: a copy of the folder, or an object that was unpickled. So no test can spoil it for
    another process, and a thing must only depend on the sources of this checkout, not on who asks.
    """

    def __init__(self, store: Path) -> None:
        self._store = store
        store.mkdir(exist_ok=True)

    def folder(self, name: str, make: Callable[[Path], object], to: Path) -> Path:
        """A copy, at `to`, of the folder `name`, which `make` fills when it is not there yet."""
        with self._locked(name) as place:
            if not place.exists():
                building = place.with_suffix(".building")
                shutil.rmtree(building, ignore_errors=True)  # of a process that failed
                building.mkdir()
                make(building)
                building.rename(place)
        return Path(shutil.copytree(place, to, dirs_exist_ok=True))

    def value(self, name: str, make: Callable[[], Value]) -> Value:
        """What `make` returns, as it comes back from a pickle."""
        with self._locked(name) as place:
            if not place.exists():
                building = place.with_suffix(".building")
                building.write_bytes(pickle.dumps(make(), pickle.HIGHEST_PROTOCOL))
                building.rename(place)
        found: Value = pickle.loads(place.read_bytes())
        return found

    @contextmanager
    def _locked(self, name: str) -> Iterator[Path]:
        """The place of the thing `name`, while no other process is at it."""
        lock = os.open(self._store / f"{name}.lock", os.O_CREAT | os.O_RDWR)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX)  # goes with the descriptor, also when the process dies
            yield self._store / name
        finally:
            os.close(lock)
