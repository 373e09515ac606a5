"""SIGKILL at random moments: ``python test/bench/kills.py [--count 1000] [--commands replay,record]``; also run by make soak.

Real commands on short sessions, each killed once; half of the moments are drawn
over the whole run, half over the time in which it writes. After every kill: no recording has changed, an earlier result is
there whole or the new one is, and what is not whole says so, to ``info`` and ``compare`` too. Exit code 1 if not so.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from argparse import ArgumentParser
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from command import main as command_line
from default_boom import strokes_of_posture
from recordings import read, recover, scan, write_session

from boom_twin import BagError, load_scene
from boom_twin.bag.session_model import incompleteness

PATIENCE = 300.0
STEP = 5_000_000
JOINT_STATE = "sensor_msgs/msg/JointState"
SCENE = """\
description: one rigid section on an oil spring, surrogate parameters
gravity: [0.0, -9.81]
material: {name: steel, E: 2.06e+11, nu: 0.3, rho: 7850.0}
base: {pivot: [0.0, 0.0], cylinder_pin: [0.45, -1.25]}
sections:
  - {length: 3.0, root: {mass: 40.0, com: [1.4, 0.1], inertia: 30.0}, rod_pin: [0.60, -0.12]}
joints:
  - {kind: A, range_deg: [-5, 85], cylinder: {k: 2.0e6, closed_length: 1.08, max_stroke: 0.79}}
postures: {up: [40]}
"""


class Broken(Exception):
    """What must not be."""


def require(is_so: bool, what: str) -> None:
    if not is_so:
        raise Broken(what)


def sums(folder: Path) -> dict[str, str]:
    """SHA-256 of all files by path."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def said(*arguments: object) -> tuple[int, str]:
    """Exit code and words of a command in this process."""
    words = io.StringIO()
    with contextlib.redirect_stdout(words), contextlib.redirect_stderr(words):
        code = command_line([str(argument) for argument in arguments])
    return code, words.getvalue()


class Run:
    """A command as a process."""

    def __init__(self, arguments: list[str], log: Path) -> None:
        self._log = log
        command = [sys.executable, "-m", "boom_twin.cli.main", *arguments]
        with log.open("w") as file:
            self.process = subprocess.Popen(command, stdout=file, stderr=file)

    def kill(self) -> str:
        """Kill the process; say if it had ended before."""
        if self.process.poll() is not None:
            return "ended before"
        self.process.kill()
        self.process.wait()
        return "killed"

    def finish(self) -> None:
        require(self.process.wait(PATIENCE) == 0, f"a run that was not killed failed:\n{self._log.read_text()}")


class Target:
    """A command, what it reads, and what it must leave.

    Parameters
    ----------
    place : Path
        New folder for all of it.
    """

    def __init__(self, place: Path, dice: random.Random) -> None:
        self.place, self.dice, self.sources = place, dice, place / "sources"
        self.sources.mkdir(parents=True)
        self.scene = self.sources / "scene.yaml"
        self.scene.write_text(SCENE)
        self.out, self.number = place / "out", 0
        self.prepare()
        self.kept = sums(self.sources)
        self.seconds, self.writing = self._measure()

    def prepare(self) -> None:
        """Make the sources."""

    def arguments(self) -> list[str]:
        raise NotImplementedError

    def sign(self) -> Path:
        """What is there as soon as the command writes."""
        return self.out.with_name("out.unfinished")

    def check(self, hit: str) -> str:
        """Look at what a kill left; says what it was."""
        raise NotImplementedError

    def clear(self) -> None:
        """Make room for the next run, as a user would."""

    def once(self) -> tuple[str, str]:
        """One run with one kill."""
        run = Run(self.arguments(), self.place / "log")
        self._wait(run)
        hit = run.kill()
        require(sums(self.sources) == self.kept, "a source has changed")
        left = self.check(hit)
        self.clear()
        return hit, left

    def _wait(self, run: Run) -> None:
        """Until the moment of the kill."""
        span = 1.05 * self.seconds
        if self.dice.random() < 0.5:
            self._until(run)
            span = 1.3 * self.writing
        end = time.monotonic() + self.dice.uniform(0.0, span)
        while run.process.poll() is None and time.monotonic() < end:
            time.sleep(min(0.005, max(0.0, end - time.monotonic())))

    def _until(self, run: Run) -> None:
        end = time.monotonic() + PATIENCE
        while run.process.poll() is None and not self.sign().exists():
            require(time.monotonic() < end, "it does not begin to write")
            time.sleep(0.002)

    def _measure(self) -> tuple[float, float]:
        """Seconds of a whole run, and of its part that writes."""
        began = time.monotonic()
        run = Run(self.arguments(), self.place / "log")
        self._until(run)
        wrote = time.monotonic()
        run.finish()
        ended = time.monotonic()
        self.clear()
        return ended - began, ended - wrote


class Replay(Target):
    """Of two sessions in turn into one folder, so that most runs replace an earlier result."""

    def prepare(self) -> None:
        self.references: list[object] = []
        for name, rows in (("first", 150), ("second", 200)):
            stamps = 1_700_000_000_000_000_000 + STEP * np.arange(rows)
            strokes = np.tile(strokes_of_posture(load_scene(self.scene), "up"), (rows, 1))
            write_session(self.sources / name, stamps, strokes, np.zeros((rows, 1)), None, {"origin": "synthetic, a test"})
            Run(self._command(name), self.place / "log").finish()
            self.references.append(self.result())

    def _command(self, name: str) -> list[str]:
        lean = ["--no-health", "--no-pictures"]
        return ["replay", str(self.sources / name), "--scene", str(self.scene), "--out", str(self.out), *lean]

    def arguments(self) -> list[str]:
        self.number += 1
        return self._command(("first", "second")[self.number % 2])

    def result(self) -> object:
        return json.loads((self.out / "summary.json").read_text())["output_sha256"]

    def check(self, hit: str) -> str:
        require(self.out.is_dir(), "neither the earlier result nor the new one is there")
        listed = json.loads((self.out / "manifest.json").read_text())["files"]
        found = {name: digest for name, digest in sums(self.out).items() if name not in ("manifest.json", "unfinished.json")}
        require(found == listed and {"quantities.json", "bag/metadata.yaml"} <= set(found), "OUT is not whole")
        require(self.result() in self.references and found["bag/session_0.mcap"] == self.result(), "OUT is another result")
        require(said("info", self.out / "bag")[0] == 0 and not incompleteness(self.out), "a whole result is called incomplete")
        new = self.result() == self.references[self.number % 2]
        require(hit != "ended before" or new, "a run that ended left the earlier result")
        unfinished = self.sign()
        if not unfinished.exists() or (unfinished / "manifest.json").exists() or not any(unfinished.iterdir()):
            return "new result" if new else "earlier result"
        code, words = said("compare", unfinished, self.out)
        require(code == 1 and "incomplete" in words, f"compare takes an unfinished replay for whole: {words}")
        if (unfinished / "bag").exists():
            code, words = said("info", unfinished / "bag")
            require("incomplete" in words, f"info takes an unfinished replay for whole: {words}")
        return "earlier result, and an unfinished one that says so"


class Record(Target):
    """A recording that has not ended in order says so, and all but its last moments can be saved."""

    def arguments(self) -> list[str]:
        self.number += 1
        split = ["--split-duration", "0.4"] if self.number % 2 else []
        return ["record", "--out", str(self.out), "--topics", "cylinder_strokes", *split]

    def sign(self) -> Path:
        return self.out / "session.yaml"

    def _measure(self) -> tuple[float, float]:
        began = time.monotonic()
        run = Run(self.arguments(), self.place / "log")
        self._until(run)
        wrote = time.monotonic()
        while not any(file.stat().st_size > 4000 for file in self.out.glob("*.mcap")) and time.monotonic() < wrote + 60.0:
            time.sleep(0.05)  # until publisher and recorder have found each other
        time.sleep(2.0)
        run.process.send_signal(signal.SIGINT)
        run.finish()
        code, words = said("info", self.out)
        require(code == 0 and "incomplete" not in words, f"a recording that ended in order is called incomplete: {words}")
        self.clear()
        return wrote - began + 2.0, 2.0

    def check(self, hit: str) -> str:
        if not self.out.exists() or not any(self.out.iterdir()):
            return "nothing"
        kept = sums(self.out)
        _, words = said("info", self.out)
        require("incomplete" in words, f"info takes a killed recording for whole: {words}")
        saved = self.place / "saved"
        try:
            recover(self.out, saved)
        except BagError as error:
            require("nothing can be saved" in str(error) and not saved.exists(), str(error))
            return "nothing yet"
        numbers = [round(1e6 * msg.position[0]) for _, _, msg in read(scan(saved), {"cylinder_strokes": JOINT_STATE})]
        require(numbers == list(range(numbers[0], numbers[0] + len(numbers))), "messages are missing within a recording")
        require(sums(self.out) == kept, "recover has changed its source")
        return "a recording that says so, saved"

    def clear(self) -> None:
        for folder in (self.out, self.place / "saved"):
            shutil.rmtree(folder, ignore_errors=True)


KINDS: dict[str, type[Target]] = {"replay": Replay, "record": Record}


@contextlib.contextmanager
def strokes() -> Iterator[None]:
    """Numbered strokes at 200 Hz, for the recorder."""
    import rclpy
    from sensor_msgs.msg import JointState

    rclpy.init(args=[])
    node = rclpy.create_node("source_of_strokes")
    publisher, end = node.create_publisher(JointState, "cylinder_strokes", 100), threading.Event()

    def publish() -> None:
        number, began = 0, time.monotonic()
        while not end.wait(max(0.0, began + number * 0.005 - time.monotonic())):
            number += 1
            msg = JointState(name=["cylinder_1"], position=[1e-6 * number])
            msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(time.time_ns(), 10**9)
            publisher.publish(msg)

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join()
        node.destroy_node()
        rclpy.try_shutdown()


def kills(command: str, count: int, place: Path, seed: int) -> Counter[tuple[str, str]]:
    """Kill a command so many times; what was hit and what it left, counted. Broken says what must not be."""
    found: Counter[tuple[str, str]] = Counter()
    with tqdm(total=count, desc=command, disable=None) as bar, strokes() if command == "record" else contextlib.nullcontext():
        target = KINDS[command](place / command, random.Random(seed))
        for number in range(count):
            try:
                found[target.once()] += 1
                bar.update()
            except Broken as error:
                raise Broken(f"{command}, seed {seed}, kill {number}: {error} (see {target.place})") from None
    return found


def main() -> int:
    """Run, print what was found."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="kills in all (1000)")
    parser.add_argument("--commands", default=",".join(KINDS), help=f"({','.join(KINDS)})")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="(the time)")
    args = parser.parse_args()
    names = args.commands.split(",")
    if "record" not in names:
        return _run(names, args.count, args.seed)
    from demo.isolation import isolated

    with isolated():
        return _run(names, args.count, args.seed)


def _run(names: list[str], total: int, seed: int) -> int:
    place = Path(tempfile.mkdtemp(prefix="boom_twin_kills_"))
    began = time.monotonic()
    for number, name in enumerate(names):
        count = total * (number + 1) // len(names) - total * number // len(names)
        try:
            found = kills(name, count, place, seed)
        except Broken as error:
            print(error)
            return 1
        for (hit, left), times in sorted(found.items()):
            print(f"{name:10s} {times:5d}  hit: {hit:14s} left: {left}", flush=True)
    shutil.rmtree(place)
    print(f"{total} kills in {time.monotonic() - began:.0f} s: no recording lost, nothing unfinished taken for whole")
    return 0


if __name__ == "__main__":
    sys.exit(main())
