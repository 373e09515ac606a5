"""`boom_twin play`: publish a recorded session over ROS 2."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from ..bag.reader import scan
from ..errors import BoomTwinError
from ..offline.progress import ProgressLine
from ..ros.startup import require_rclpy
from ..types import NANO
from .arguments import add_ros_args, not_negative, positive, ros_arguments
from .output import tell, warn

if TYPE_CHECKING:
    from ..ros.bag.player import Player


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("bag", metavar="BAG", type=Path, help="rosbag2 directory, or a file: .mcap, .db3, .bag of ROS 1, .csv")
    parser.add_argument("--rate", type=positive, default=1.0, metavar="R", help="session over real time (default 1)")
    parser.add_argument("--start", type=not_negative, default=0.0, metavar="S", help="begin after S seconds (default 0)")
    parser.add_argument("--duration", type=positive, metavar="S", help="play S seconds (default: all)")
    parser.add_argument("--loop", action="store_true", help="repeat until Ctrl-C")
    parser.add_argument("--topics", nargs="+", metavar="NAME", help="topics to play (default: inputs of the twin)")
    purpose = "also publish the log times on /clock, HZ times a second (without a value 40)"
    parser.add_argument("--clock", nargs="?", type=positive, const=40.0, metavar="HZ", help=purpose)
    purpose = "wait S seconds for listeners (default 10; 0: do not)"
    parser.add_argument("--wait", type=not_negative, default=10.0, metavar="S", help=purpose)
    purpose = "listeners of every topic to wait for: 2 for node and recorder (default 1)"
    parser.add_argument("--listeners", type=int, choices=range(1, 100), default=1, metavar="N", help=purpose)
    add_ros_args(parser)


def run(args: Namespace) -> int:
    require_rclpy()
    from ..ros.bag.player import Player
    from ..ros.runtime import ros

    session = scan(args.bag)
    with ros(ros_arguments(args)):
        player = Player(session, args.topics, args.clock)
        length = player.length(args.start, args.duration)
        unmatched = player.wait(args.wait, args.listeners)
        if unmatched and args.wait > 0.0:
            _check_listeners(unmatched, player.unmatched(), len(player.topics), args)
        try:
            _play(player, args, length)
            if late := player.deliver():
                warn(f"a listener did not acknowledge all messages of {', '.join(late)}: its recording may lack the end")
        except KeyboardInterrupt:
            if not args.loop:
                raise
        player.close()
    sent = ", ".join(f"{name} {count}" for name, count in player.sent.items())
    tell(f"sent in {player.wall:.1f} s: {sent}; at worst {player.latest * 1e3:.1f} ms late")
    return 0


def _play(player: Player, args: Namespace, length: float) -> None:
    if not sys.stderr.isatty():
        tell(f"playing {length:.1f} s")
    while True:
        with closing(ProgressLine(length, "s", "playing")) as line:
            for elapsed in player.play(args.rate, args.start, args.duration):
                line.update(elapsed * NANO - line.done)
        if not args.loop:
            return


def _check_listeners(unmatched: list[str], unheard: list[str], topics: int, args: Namespace) -> None:
    """Raise BoomTwinError if nobody listens to any topic; warn of single topics with too few listeners."""
    if len(unheard) == topics:
        raise BoomTwinError(
            f"nobody listened within {args.wait:g} s. Start twin_node, check ROS_DOMAIN_ID and namespace, or play anyway "
            "with --wait 0."
        )
    listeners = "nobody listens" if args.listeners == 1 else f"fewer than {args.listeners} listen"
    warn(f"{listeners} to {', '.join(unmatched)}")
