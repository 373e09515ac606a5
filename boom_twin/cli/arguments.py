"""Arguments that several commands have: numbers within bounds, and the window of a session."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..bag.time_window import TimeWindow


SESSION = "a rosbag2 directory, a directory of its files, or one file: .mcap, .db3, .bag of ROS 1, .csv"


def positive(text: str) -> float:
    """Parse a number above 0."""
    value = not_negative(text)
    if value == 0.0:
        raise ArgumentTypeError(f"{text}: must be > 0")
    return value


def not_negative(text: str) -> float:
    """Parse a finite number of at least 0."""
    try:
        value = float(text)
    except ValueError:
        raise ArgumentTypeError(f"{text}: not a number") from None
    if not 0.0 <= value < float("inf"):
        raise ArgumentTypeError(f"{text}: must be >= 0 and finite")
    return value


def add_mapping(parser: ArgumentParser) -> None:
    """Declare ``--mapping``, for `boom_twin.bag.session_model.mapping_of`."""
    told = "topics and sensors; by default as the session was recorded, else what `boom_twin mapping` prints"
    parser.add_argument("--mapping", metavar="FILE", type=Path, help=told)


def add_window(parser: ArgumentParser) -> None:
    """Declare ``--start`` and ``--duration``, for `window_of`."""
    begin = "begin so many seconds after the first sample (0); the model then starts at rest there"
    parser.add_argument("--start", type=not_negative, default=0.0, metavar="S", help=begin)
    parser.add_argument("--duration", type=positive, metavar="S", help="read so many seconds (all)")


def window_of(args: Namespace) -> TimeWindow:
    """Return the part of a session that the arguments name."""
    from ..bag.time_window import TimeWindow

    return TimeWindow(args.start, args.duration)
