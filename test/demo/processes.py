"""Processes of a demonstration: node, recorder and player, isolated from other ROS 2 traffic."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from boom_twin import BoomTwinError
from boom_twin.bag.async_writer import PATIENCE as DISK_PATIENCE
from boom_twin.ros.startup import STOPS, on_stop_signal
from boom_twin.system.processes import end_process, python_command

from .isolation import isolated

if TYPE_CHECKING:
    from boom_twin.ros.bag.player import Player


PATIENCE = 300.0
"""Seconds that the node may take to get ready; compiling takes up to a minute on a machine of its own."""
END_TIMEOUT = 2 * DISK_PATIENCE
"""Seconds that a process may take to end: longer than a recorder waits for its disk, or a slow disk would cost messages."""
LOOK = 1.0
"""Seconds between looks at whether all have found each other."""
LISTENERS = 2
"""Subscribers of every input: node and recorder."""


class DemoProcess:
    """Module of this package, run as a child that writes into a new `log` and ends in order by `end_signal`.

    It holds the domain's `lock` (`demo.isolation.Isolation`) as long as it runs, even if its parent is killed.
    """

    def __init__(self, arguments: list[str], log: Path, end_signal: signal.Signals, lock: int) -> None:
        self._name, self._log, self._end_signal = " ".join(arguments[:2]), log, end_signal
        with _new(log) as file:
            command = python_command(*arguments)
            self._process = subprocess.Popen(command, stdout=file, stderr=file, pass_fds=(lock,))

    def output(self) -> str:
        return self._log.read_text(encoding="utf-8")

    def check(self) -> None:
        """Raise BoomTwinError if the process has ended."""
        if self._process.poll() is not None:
            last = (self.output().strip().splitlines() or ["nothing was said"])[-1]
            raise BoomTwinError(f"{self._name} ended with {self._process.returncode}: {last} (see {self._log})")

    def end(self) -> None:
        end_process(self._process, END_TIMEOUT, self._end_signal)


class DemoProcesses:
    """Node, recorder, and those that are started later.

    They write beside the recording, in folder `out`, under its name. No file that is there is written over. `scene` is text.
    """

    def __init__(self, out: Path, scene: str, lock: int) -> None:
        self._scene, self._lock, self.recorded = scene, lock, _free(out / "recorded")
        self._children: list[DemoProcess] = []
        self._is_asked_to_end = False

    def begin(self, origin: str) -> None:
        """Start node and recorder; `origin` is kept in the recording."""
        scene = self._beside("scene.yaml")
        with _new(scene) as file:
            file.write(self._scene)
        self.start("node", ["boom_twin.ros.node.main", "--ros-args", "-p", f"scene:={scene}"], signal.SIGTERM)
        record = ["boom_twin.cli.main", "record", "--out", str(self.recorded), "--origin", origin, "--scene", str(scene)]
        self._recorder = self.start("recorder", record, signal.SIGINT)

    def start(self, name: str, arguments: list[str], end_signal: signal.Signals) -> DemoProcess:
        self._children.append(DemoProcess(arguments, self._beside(f"{name}.log"), end_signal, self._lock))
        return self._children[-1]

    def _beside(self, name: str) -> Path:
        return self.recorded.with_name(f"{self.recorded.name}.{name}")

    def check(self) -> None:
        """Raise BoomTwinError if one of them has ended, KeyboardInterrupt after SIGINT or SIGTERM."""
        if self._is_asked_to_end:
            raise KeyboardInterrupt
        for child in self._children:
            child.check()

    def ask_to_end(self) -> None:
        """Make the next `check` raise KeyboardInterrupt."""
        self._is_asked_to_end = True

    def play(self, player: Player, duration: float | None = None) -> Iterator[int]:
        """Play as `boom_twin.ros.bag.player.Player.play` does, as long as all processes run."""
        for elapsed in player.play(duration=duration):
            self.check()
            yield elapsed

    def wait_for_discovery(self, player: Player) -> None:
        """Wait until node, recorder and `player` have found each other; BoomTwinError if they do not."""
        from boom_twin.ros.bag.recorder import COMPLETE

        print("starting the node; the first time it compiles for up to a minute ..", file=sys.stderr)
        end = time.monotonic() + PATIENCE
        while player.wait(LOOK, LISTENERS) or COMPLETE not in self._recorder.output():
            self.check()
            if time.monotonic() > end:
                raise BoomTwinError(f"node, recorder and player did not find each other within {PATIENCE:g} s.")

    def end(self) -> None:
        with ExitStack() as stack:
            for child in self._children:
                stack.callback(child.end)


@contextmanager
def _new(path: Path) -> Iterator[TextIO]:
    """Create a file that must not be there yet, and provide it for writing within a context."""
    try:
        with path.open("x", encoding="utf-8") as file:
            yield file
    except OSError as error:
        reason = f"cannot be written ({error.strerror}). Make room, or give another folder with --out."
        raise BoomTwinError(f"{path}: {reason}") from None


def _free(folder: Path) -> Path:
    """Return `folder`, with a number behind its name if it, or a file that goes beside it, is there already."""
    taken = {entry.name for entry in folder.parent.iterdir()}
    numbered = (folder.with_name(f"{folder.name}_{number}") for number in count(2))
    return next(
        path
        for path in chain([folder], numbered)
        if path.name not in taken and not any(name.startswith(f"{path.name}.") for name in taken)
    )


@contextmanager
def demo_processes(out: Path, origin: str, scene: str, domain: int | None = None) -> Iterator[DemoProcesses]:
    """Provide node and recorder within a context, isolated; `origin` is kept in the recording, those of earlier runs stay."""
    with isolated(domain) as isolation:
        print(isolation, file=sys.stderr)
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BoomTwinError(f"{error.filename}: {error.strerror}. Give another folder with --out.") from None
        yield from _run(DemoProcesses(out, scene, isolation.lock), origin)


def _run(running: DemoProcesses, origin: str) -> Iterator[DemoProcesses]:
    """Start the processes, and end them whatever happens."""
    before = {number: signal.getsignal(number) for number in STOPS}
    on_stop_signal(running.ask_to_end)
    try:
        running.begin(origin)
        yield running
    finally:
        running.end()
        for number, act in before.items():
            signal.signal(number, act)
