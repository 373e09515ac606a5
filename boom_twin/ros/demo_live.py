"""A session played in a loop into the live node, with recorder and monitor: what a rig looks like in a browser.

Run by ``make demo-live``; Ctrl-C ends it. The bundled session is synthetic (virtual rig, surrogate parameters).
"""

from __future__ import annotations

import re
import signal
import sys
import time
from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..errors import BoomTwinError
from ..io.reader import scan
from .demo import LOOK, NODE, PATIENCE, RECORDER, Child, child, isolate, make_room
from .require import require_rclpy

MONITOR = ["-m", "boom_twin.cli.main", "monitor", "--allow", "mark", "acknowledge"]
LISTENERS = 2
"""Of every input: node and recorder."""


def main() -> int:
    """Play until Ctrl-C; returns the exit code."""
    args = _arguments()
    try:
        require_rclpy()
        isolate()
        make_room(args.out, args.out / "recorded")
        _run(args)
    except BoomTwinError as error:
        print(f"demo-live: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("demo-live: stopped", file=sys.stderr)
    return 0


def _arguments() -> Namespace:
    parser = ArgumentParser(prog="python -m boom_twin.ros.demo_live", description="Watch a played session live.")
    parser.add_argument("--bag", type=Path, default=Path("bags/arch_session"), help="session (bags/arch_session)")
    parser.add_argument("--out", type=Path, default=Path("out/demo_live"), help="folder for recording and logs")
    parser.add_argument("--port", default="8420", help="of the page (8420; 0: any that is free)")
    return parser.parse_args()


def _run(args: Namespace) -> None:
    recorder = [*RECORDER, "--out", str(args.out / "recorded")]
    with (
        child(NODE, args.out / "node.log", signal.SIGTERM) as node,
        child(recorder, args.out / "recorder.log", signal.SIGINT) as record,
        child([*MONITOR, "--port", args.port], args.out / "monitor.log", signal.SIGTERM) as monitor,
    ):
        _play(args, [node, record, monitor])


def _play(args: Namespace, children: list[Child]) -> None:
    """Wait until all are there, tell where the page is, and play again and again."""
    from .context import ros
    from .player import Player

    def check() -> None:
        for each in children:
            each.check()

    with ros([]):
        player = Player(scan(args.bag))
        print("starting the node; the first time it compiles for up to a minute ..", file=sys.stderr)
        end = time.monotonic() + PATIENCE
        while player.wait(LOOK, LISTENERS, check):
            if time.monotonic() > end:
                raise BoomTwinError(f"node, recorder and player did not find each other within {PATIENCE:g} s.")
        found = re.search(r"http://\S+", (args.out / "monitor.log").read_text(encoding="utf-8"))
        print(f"open {found[0] if found else 'the page'} in a browser; Ctrl-C ends it", file=sys.stderr, flush=True)
        while True:
            for _ in player.play():
                pass
            check()


if __name__ == "__main__":
    sys.exit(main())
