"""`boom_twin monitor`: the live page, of the twin's topics or of a recorded session."""

from __future__ import annotations

import os
import sys
from argparse import SUPPRESS, ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Iterator
from contextlib import closing, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import BoomTwinError, UsageError
from ..monitor import ACTS, PORT
from ..system.processes import LESS_URGENT
from .arguments import add_ros_args, add_session, ros_arguments, window_of
from .output import open_scene, open_session_scene, open_session_settings, tell, warn_incomplete

if TYPE_CHECKING:
    from ..monitor.data.feed import Feed


def add_arguments(parser: ArgumentParser) -> None:
    told = "show this recorded session, or the bag of a replay (default: the live topics)"
    parser.add_argument("--bag", metavar="BAG", type=Path, help=told)
    add_session(parser, namespace=False)  # `add_ros_args` has it
    parser.add_argument("--port", type=_port, help=f"TCP port (default {PORT}, or a free one if that is taken; 0: a free one)")
    parser.add_argument("--host", default="127.0.0.1", help="listen here (default 127.0.0.1); elsewhere viewers need a token")
    token = "file that holds the token, asked for on this machine too (default: a new token at each start)"
    parser.add_argument("--token-file", metavar="FILE", type=Path, help=token)
    allow = "actions that viewers may take: mark, acknowledge (default: both; without names: none)"
    parser.add_argument("--allow", nargs="*", choices=ACTS, default=ACTS, metavar="ACT", help=allow)
    parser.add_argument("--until-stdin-ends", action="store_true", help=SUPPRESS)  # it ends with the node that started it
    add_ros_args(parser)


def _port(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) < 65536):
        raise ArgumentTypeError(f"{text}: must be a whole number from 0 to 65535")
    return int(text)


def run(args: Namespace) -> int:
    """Serve until Ctrl-C, SIGTERM or the end of the terminal."""
    if find_spec("aiohttp") is None:
        raise UsageError('aiohttp is not installed, and the page needs it. Run `pip install "boom_twin[monitor]"`.')
    import asyncio
    import logging

    _lower_priority()
    logging.basicConfig(level=logging.WARNING, format="%(message)s")
    with closing(_bag_feed(args)) if args.bag is not None else _live_feed(args) as feed:
        asyncio.run(_serve(args, feed))
    return 0


def _lower_priority() -> None:
    """Lower this process's priority, so that the node on the same machine runs first and is not interrupted within a step."""
    os.nice(LESS_URGENT)
    if hasattr(os, "SCHED_BATCH"):  # Linux: does not preempt others when it wakes up
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def _bag_feed(args: Namespace) -> Feed:
    from ..bag.reader import scan
    from ..monitor.data.bag_feed import bag_feed

    warn_incomplete(scan(args.bag))
    scene, settings = open_session_scene(args.bag, args.scene), open_session_settings(args.bag, args.params, args.namespace)
    return bag_feed(args.bag, scene, settings, args.mapping, window_of(args), args.namespace)


@contextmanager
def _live_feed(args: Namespace) -> Iterator[Feed]:
    from ..ros.startup import require_rclpy

    require_rclpy()
    from ..messages.mapping import load_mapping
    from ..ros.monitor_feed import TopicFeed
    from ..ros.runtime import ros

    with ros(ros_arguments(args)):
        shown = open_scene(args.scene) if args.scene else None
        with closing(TopicFeed(load_mapping(args.mapping), shown)) as feed:
            yield feed


async def _serve(args: Namespace, feed: Feed) -> None:
    import asyncio

    from ..monitor.server import AccessControl, Server, serving, token_of
    from ..monitor.viewer import ViewerActions
    from ..ros.startup import stop_signals

    access = AccessControl(args.host, "" if args.token_file is None else token_of(args.token_file))
    loop, stopped = asyncio.get_running_loop(), asyncio.Event()
    for number in stop_signals():
        loop.add_signal_handler(number, stopped.set)
    if args.until_stdin_ends:
        loop.add_reader(sys.stdin, stopped.set)
    server = Server(feed, ViewerActions(feed, args.allow), access)
    try:
        async with serving(server, access, args.host, args.port) as address:
            tell(f"open {address}   (Ctrl-C ends it)", is_kept=True)
            await stopped.wait()
    except OSError as error:
        raise BoomTwinError(f"cannot listen on {args.host}:{args.port}: {error.strerror}. Choose another --port.") from None
