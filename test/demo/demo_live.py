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

from recordings import scan, scene_of

from boom_twin import BoomTwinError
from boom_twin.ros.startup import require_rclpy

from .isolation import add_domain
from .processes import LOOK, DemoProcesses, demo_processes


def main() -> int:
    """Play until Ctrl-C and return the exit code."""
    args = _arguments()
    try:
        require_rclpy()
        with demo_processes(args.out, f"demo-live of {args.bag}", scene_of(args.bag).text, args.domain) as running:
            _play(args, running)
    except BoomTwinError as error:
        print(f"demo-live: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("demo-live: stopped", file=sys.stderr)
    return 0


def _arguments() -> Namespace:
    parser = ArgumentParser(prog="python -m demo.demo_live", description="Watch a played session live.")
    parser.add_argument("--bag", type=Path, default=Path("bags/arch_session"), help="session (bags/arch_session)")
    parser.add_argument("--out", type=Path, default=Path("out/demo_live"), help="folder for recording and logs")
    parser.add_argument("--port", help="of the page (8420, or any that is free if that is taken)")
    add_domain(parser)
    return parser.parse_args()


def _play(args: Namespace, running: DemoProcesses) -> None:
    """Wait until all are there, tell where the page is, and play again and again; BoomTwinError as soon as one has ended."""
    from boom_twin.ros.bag.player import Player
    from boom_twin.ros.runtime import ros

    command = ["boom_twin.cli.main", "monitor", *(["--port", args.port] if args.port else [])]
    monitor = running.start("monitor", command, signal.SIGTERM)
    with ros([]):
        player = Player(scan(args.bag))
        running.wait_for_discovery(player)
        while not (found := re.search(r"open (http://\S+)", monitor.output())):
            running.check()
            time.sleep(0.1 * LOOK)
        print(f"open {found[1]} in a browser; Ctrl-C ends it", file=sys.stderr, flush=True)
        while True:
            for _ in running.play(player):
                pass


if __name__ == "__main__":
    sys.exit(main())
