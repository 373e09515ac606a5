"""`boom_twin record`: record the session topics from ROS 2."""

from __future__ import annotations

import sys
import time
from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..errors import BoomTwinError
from ..io.topics import Topic, load_topics
from ..ros.require import require_rclpy
from .play import positive


def add_arguments(parser: ArgumentParser) -> None:
    """Where to, and what."""
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="directory of the bag, new or empty")
    parser.add_argument(
        "--only", choices=["inputs", "outputs"], help="what goes into the twin, or what it publishes (both)"
    )
    parser.add_argument("--duration", type=positive, metavar="S", help="stop after so many seconds (on Ctrl-C)")
    parser.add_argument("--origin", metavar="TEXT", help="kept in the bag: where this comes from")


def run(args: Namespace) -> int:
    """Record until Ctrl-C, SIGTERM or the end of the duration, and tell on stderr what came."""
    require_rclpy()
    from ..ros.context import on_stop_signal, ros
    from ..ros.recorder import record

    signals: list[bool] = []
    on_stop_signal(lambda: signals.append(True))
    end = float("inf") if args.duration is None else time.monotonic() + args.duration
    topics = _topics(args.only)
    with ros([]):
        counts = record(
            args.out,
            topics,
            {"origin": args.origin} if args.origin else {},
            stopped=lambda: bool(signals) or time.monotonic() >= end,
            tell=lambda text: print(text, file=sys.stderr, flush=True),
        )
    for key, topic in topics.items():
        print(f"  {counts[key]:8d}  {topic.absolute}", file=sys.stderr)
    if not counts:
        raise BoomTwinError(f"{args.out}: nothing came. Check that the publishers run, and ROS_DOMAIN_ID.")
    return 0


def _topics(only: str | None) -> dict[str, Topic]:
    """The chosen topics of ``topics.yaml`` by role."""
    known = load_topics()
    inputs = {stream.value: topic for stream, topic in known.inputs.items()}
    outputs = {key.value: topic for key, topic in known.outputs.items()}
    return {**({} if only == "outputs" else inputs), **({} if only == "inputs" else outputs)}
