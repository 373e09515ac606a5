"""The demonstration: a recorded session played over DDS into the live node, its outputs recorded and judged.

Three processes: ``twin_node``, ``boom_twin record``, and this one, which plays. Run by ``make demo``. The bundled
session is synthetic (virtual rig, surrogate parameters).
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tqdm import tqdm

from ..errors import BoomTwinError
from ..io.reader import Session, scan
from ..pictures import draw, history_of
from ..records import Stream
from ..replay import Replay, replay
from ..scene import load_scene
from ..truth import FILE_NAME as TRUTH
from .require import require_rclpy
from .scorecard import Scorecard, score

PATIENCE = 300.0
"""Seconds that the node may take to get ready; compiling takes up to a minute on a machine of its own."""
PARTING = 10.0
"""Seconds that a process may take to end."""
LOOK = 1.0
"""Seconds between looks at whether all have found each other."""
SETTLE = 1.0
"""Seconds for the last messages to arrive."""
BAR = "playing {l_bar}{bar}| {n:.1f}/{total:.1f} s"

NODE = ["-m", "boom_twin.ros.main"]
RECORDER = ["-m", "boom_twin.cli.main", "record"]


def main() -> int:
    """Run the demonstration; returns the exit code, 1 if no output arrived."""
    args = _arguments()
    try:
        require_rclpy()
        isolate()
        session = scan(args.bag)
        recorded = args.out / "recorded"
        make_room(args.out, recorded)
        sent = _run(session, args, recorded)
        if (args.bag / TRUTH).is_file():
            shutil.copy(args.bag / TRUTH, recorded)
        card, scene = score(recorded), load_scene()
        again = replay(recorded, scene, args.out / "replay")
        about = f"{session.path.name} ({_origin(session)})"
        print("\n".join(card.as_text(about, sent[Stream.STROKES.value], _equal(card, again))))
        for path in [recorded, *draw(again, history_of(again.recording, scene), args.out)]:
            print(path)
        print(f"see it in a browser: {sys.executable} -m boom_twin.cli.main monitor --bag {recorded}")
        return 0
    except BoomTwinError as error:
        print(f"demo: {error}", file=sys.stderr)
    except KeyboardInterrupt:
        print("demo: stopped", file=sys.stderr)
    return 1


def _arguments() -> Namespace:
    parser = ArgumentParser(prog="python -m boom_twin.ros.demo", description="Play a session into the live twin.")
    parser.add_argument("--bag", type=Path, default=Path("bags/arch_session"), help="session (bags/arch_session)")
    parser.add_argument("--duration", type=float, default=30.0, help="seconds of it (30)")
    parser.add_argument("--out", type=Path, default=Path("out/demo"), help="folder for the results (out/demo)")
    return parser.parse_args()


def isolate() -> None:
    """Keep this process and its children out of any other ROS 2 traffic."""
    os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % 101)
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"


def make_room(out: Path, recorded: Path) -> None:
    """The folder of the results, without the recording of an earlier run."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        if recorded.is_dir():
            shutil.rmtree(recorded)
    except OSError as error:
        raise BoomTwinError(f"{error.filename}: {error.strerror}. Give another folder with --out.") from None


def _run(session: Session, args: Namespace, recorded: Path) -> dict[str, int]:
    """Play with node and recorder running; gives the messages sent by topic."""
    recorder = [*RECORDER, "--out", str(recorded), "--origin", f"live run of: {_origin(session)}"]
    with (
        child(NODE, args.out / "node.log", signal.SIGTERM) as node,
        child(recorder, args.out / "recorder.log", signal.SIGINT) as record,
    ):
        return _play(session, args.duration, node, record)


def _origin(session: Session) -> str:
    return session.notes.get("origin", "origin not noted")


def _play(session: Session, duration: float, node: Child, recorder: Child) -> dict[str, int]:
    """Wait until all three have found each other, then play."""
    from .context import ros
    from .player import Player
    from .recorder import COMPLETE

    def check() -> None:
        node.check()
        recorder.check()

    with ros([]):
        player = Player(session)
        print("starting the node; the first time it compiles for up to a minute ..", file=sys.stderr)
        end = time.monotonic() + PATIENCE
        while player.wait(LOOK, 2, check) or not recorder.has_said(COMPLETE):
            check()
            if time.monotonic() > end:
                raise BoomTwinError(f"node, recorder and player did not find each other within {PATIENCE:g} s.")
        with tqdm(total=player.length(0.0, duration), ncols=80, mininterval=0.5, bar_format=BAR) as bar:
            for elapsed in player.play(duration=duration):
                bar.update(elapsed * 1e-9 - bar.n)
        check()
        time.sleep(SETTLE)
        player.close()
    return player.played.sent


class Child:
    """A running process whose words go into a log."""

    def __init__(self, arguments: list[str], log: Path) -> None:
        self._name, self._log = " ".join(arguments[:3]), log
        with log.open("w", encoding="utf-8") as file:
            self.process = subprocess.Popen([sys.executable, *arguments], stdout=file, stderr=file)

    def has_said(self, text: str) -> bool:
        return text in self._log.read_text(encoding="utf-8")

    def check(self) -> None:
        """Raise if it has ended."""
        if self.process.poll() is not None:
            last = (self._log.read_text(encoding="utf-8").strip().splitlines() or ["nothing was said"])[-1]
            raise BoomTwinError(f"{self._name} ended with {self.process.returncode}: {last} (see {self._log})")


@contextmanager
def child(arguments: list[str], log: Path, parting: signal.Signals) -> Iterator[Child]:
    """A Python process, ended by the signal `parting`."""
    child = Child(arguments, log)
    try:
        yield child
    finally:
        child.process.send_signal(parting)
        try:
            child.process.wait(PARTING)
        except subprocess.TimeoutExpired:
            child.process.kill()
            child.process.wait()


def _equal(card: Scorecard, again: Replay) -> int:
    """How many live predictions a replay of the recorded inputs gives again, to the last bit."""
    replayed = {prediction.stamp: tuple(prediction.tip_position.tolist()) for prediction in again.recording.predictions}
    return sum(replayed.get(stamp) == position for stamp, position in card.positions.items())


if __name__ == "__main__":
    sys.exit(main())
