"""`boom_twin record`: record the session topics, or any others, from ROS 2."""

from __future__ import annotations

import re
import sys
import time
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from .. import __version__
from ..errors import BoomTwinError
from ..io.mapping import load_mapping
from ..io.topics import DEFAULT_FILE, Topic
from ..ros.require import require_rclpy
from .common import open_scene
from .play import positive

if TYPE_CHECKING:
    from ..ros.recorder import Count
    from ..ros.wanted import Wanted
    from ..thresholds import Thresholds

SMALLEST = 2**20
_UNITS = {"": 1, "k": 2**10, "M": 2**20, "G": 2**30}


def add_arguments(parser: ArgumentParser) -> None:
    """Where to, and what."""
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="directory of the bag, new or empty")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--only", choices=["inputs", "outputs"], help="what goes into the twin, or what it publishes (both)")
    what.add_argument(
        "--topics",
        nargs="+",
        metavar="NAME[:TYPE]",
        help="these topics instead; a type that is not given is that of the first publisher",
    )
    parser.add_argument("--duration", type=positive, metavar="S", help="stop after so many seconds (on Ctrl-C)")
    parser.add_argument("--split-size", type=size, metavar="BYTES", help="begin a new file from this size on: 500M, 2G")
    parser.add_argument("--split-duration", type=positive, metavar="S", help="begin a new file after so many seconds")
    parser.add_argument("--scene", metavar="SCENE", help="scene of the rig, copied into session.yaml (the default one)")
    parser.add_argument("--params", metavar="FILE", type=Path, help="ROS parameter file, copied too (the package's own)")
    parser.add_argument("--mapping", metavar="FILE", type=Path, help="topics and sensors, copied and used (the package's own)")
    parser.add_argument("--note", metavar="TEXT", help="kept in session.yaml and in the bag")
    parser.add_argument("--origin", metavar="TEXT", help="kept there too: where this comes from")


def run(args: Namespace) -> int:
    """Record until Ctrl-C, SIGTERM or the end of the duration, and tell on stderr what came."""
    require_rclpy()
    from ..io.bagwriter import BagWriter
    from ..io.incomplete import incompleteness
    from ..io.sheet import Sheet
    from ..io.storage import Split, Storage
    from ..ros.context import ros
    from ..ros.recorder import record
    from ..ros.stop import on_stop_signal

    signals: list[bool] = []
    on_stop_signal(lambda: signals.append(True))
    wanted, scene, thresholds, parameters = _wanted(args), _scene_text(args.scene), *_parameters(args.params)
    mapping = (args.mapping or DEFAULT_FILE).read_text(encoding="utf-8")
    given = {"origin": args.origin, "note": args.note}
    if (told := incompleteness(args.out)) and args.out.is_dir():
        raise BoomTwinError(f"{args.out}: {told} Record into a new directory.")
    bag = BagWriter(args.out, {key: text for key, text in given.items() if text})
    types = {each.name: each.type for each in wanted}
    sheet = Sheet(__version__, scene, parameters, mapping, types, args.note, args.origin)
    sheet.write(args.out)

    def meet(twin: Mapping[str, object]) -> None:
        nonlocal sheet
        sheet = replace(sheet, twin=twin)
        sheet.write(args.out)
        _compare(str(twin.get("scene", "")), scene)

    storage = Storage(bag, Split(args.split_size, args.split_duration), _say)
    with ros([]):
        end = float("inf") if args.duration is None else time.monotonic() + args.duration
        counts = record(storage, wanted, thresholds, lambda: bool(signals) or time.monotonic() >= end, _say, meet)
    _tell(counts)
    sheet.write(args.out, [asdict(count) for count in counts])
    if not any(count.received for count in counts):
        raise BoomTwinError(f"{args.out}: nothing came. Check that the publishers run, and ROS_DOMAIN_ID.")
    return 0


def _compare(path: str, scene: str) -> None:
    """Say if the twin's scene is not the one in session.yaml."""
    try:
        is_same = _scene_text(path or None) == scene
    except BoomTwinError:
        is_same = False
    if not is_same:
        _say(f"warning: the twin's scene is {path or 'the default one'}, session.yaml holds another. Give it with --scene.")


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _tell(counts: list[Count]) -> None:
    """One line for each topic."""
    _say(" received   written  never arrived")
    for count in counts:
        missed = "unknown" if count.missed is None else str(count.missed)
        _say(f"{count.received:9d} {count.written:9d} {missed:>14}  {count.topic}")


def _wanted(args: Namespace) -> list[Wanted]:
    """The topics of the command line, or the chosen ones of ``topics.yaml``."""
    from ..ros.wanted import Wanted, wanted_of

    known = load_mapping(args.mapping)
    inputs: dict[str, Topic] = {topic.absolute: topic for topic in known.inputs.values()}
    outputs = {topic.absolute: topic for topic in [*known.outputs.values(), known.events]}
    if args.topics:
        return wanted_of(args.topics, inputs | outputs)
    chosen = {**({} if args.only == "outputs" else inputs), **({} if args.only == "inputs" else outputs)}
    return [Wanted(name, topic.type, topic) for name, topic in chosen.items()]


def _scene_text(source: str | None) -> str:
    """Text of the scene file, which must be valid."""
    from ..scene.load import default_text

    open_scene(source)
    return default_text() if source is None else Path(source).read_text(encoding="utf-8")


def _parameters(path: Path | None) -> tuple[Thresholds, str]:
    """The recorder's part of the parameter file, which must be valid, and all its text."""
    from ..settings import DEFAULT_FILE, load_settings
    from ..thresholds import load_thresholds

    load_settings(path)
    file = path or DEFAULT_FILE
    return load_thresholds(file), file.read_text(encoding="utf-8")


def size(text: str) -> int:
    """Bytes, with k, M or G for powers of 1024."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?)([kMG]?)B?", text)
    if match is None:
        raise ArgumentTypeError(f"{text!r} is not a size like 500M or 2G")
    value = int(float(match[1]) * _UNITS[match[2]])
    if value < SMALLEST:
        raise ArgumentTypeError(f"{text}: must be at least 1M: every file repeats the definitions")
    return value
