"""The demonstration: a recorded session played over DDS into the live node, its outputs recorded and judged.

Three processes: ``twin_node``, ``boom_twin record``, and this one, which plays. Run by ``make demo``. The bundled
session is synthetic (virtual rig, surrogate parameters).
"""

from __future__ import annotations

import sys
import time
from argparse import ArgumentParser, Namespace
from math import inf
from pathlib import Path

from tqdm import tqdm

from ..errors import BoomTwinError
from ..io.atomic import write_atomic
from ..io.reader import Session, scan
from ..io.results import REPLAY, result_folder
from ..io.session_model import scene_of
from ..offline.replay import Replay, replay_into
from ..pictures import draw, history_of
from ..received import holds_file, open_received
from ..records import Stream
from ..truth import FILE_NAME as TRUTH
from .company import Company, company
from .isolation import add_domain
from .require import require_rclpy
from .scorecard import Scorecard, score

SETTLE = 1.0
"""Seconds for the last messages to arrive."""
BAR = "playing {l_bar}{bar}| {n:.1f}/{total:.1f} s"


def main() -> int:
    """Run the demonstration; returns the exit code, 1 if no output arrived."""
    args = _arguments()
    try:
        require_rclpy()
        session = scan(args.bag)
        about = session.notes.get("origin", "origin not noted")
        taken = scene_of(args.bag)
        with company(args.out, f"live run of: {about}", taken.text, args.domain) as running:
            sent, recorded = _play(session, args.duration, running), running.recorded
        if holds_file(args.bag / TRUTH):
            with open_received(args.bag / TRUTH) as truth:
                write_atomic(recorded / TRUTH, truth.read())
        card = score(recorded)
        with result_folder(args.out / "replay", REPLAY, [recorded]) as building:
            again = replay_into(building, recorded, None)
            pictures = [path.name for path in draw(again, history_of(again.recording, taken.scene), building.folder)]
        print("\n".join(card.as_text(f"{session.path.name} ({about})", sent[Stream.STROKES.value], _equal(card, again))))
        for path in [recorded, *(args.out / "replay" / name for name in pictures)]:
            print(path)
        print(f"see it in a browser: {sys.executable} -P -m boom_twin.cli.main monitor --bag {recorded}")
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
    add_domain(parser)
    args = parser.parse_args()
    if not 0.0 < args.duration < inf:
        parser.error(f"--duration {args.duration}: must be > 0 and finite")
    return args


def _play(session: Session, duration: float, running: Company) -> dict[str, int]:
    """Play, once all have found each other; gives the messages sent by topic."""
    from .context import ros
    from .player import Player

    with ros([]):
        player = Player(session)
        running.meet(player)
        with tqdm(total=player.length(0.0, duration), ncols=80, mininterval=0.5, bar_format=BAR) as bar:
            for elapsed in running.play(player, duration):
                bar.update(elapsed * 1e-9 - bar.n)
        time.sleep(SETTLE)
        running.check()
        player.close()
    return player.played.sent


def _equal(card: Scorecard, again: Replay) -> int:
    """How many live predictions a replay of the recorded inputs gives again, to the last bit."""
    replayed = {prediction.stamp: tuple(prediction.tip_position.tolist()) for prediction in again.recording.predictions}
    return sum(replayed.get(stamp) == position for stamp, position in card.positions.items())


if __name__ == "__main__":
    sys.exit(main())
