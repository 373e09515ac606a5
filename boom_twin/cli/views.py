"""`boom_twin views`: what RViz, Foxglove and PlotJuggler show, for a boom in a namespace."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..errors import BoomTwinError
from ..system.files import write_atomic
from .arguments import add_namespace


def add_arguments(parser: ArgumentParser) -> None:
    place = "folder for the three files; none is overwritten"
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help=place)
    add_namespace(parser, "ROS namespace of the twin")
    parser.add_argument("--frame-prefix", metavar="TEXT", default="", help="the node's parameter frame_prefix: front/")


def run(args: Namespace) -> int:
    from ..messages.urdf import VIEWS, view_text

    args.out.mkdir(parents=True, exist_ok=True)
    if there := [args.out / view.name for view in VIEWS if (args.out / view.name).exists()]:
        raise BoomTwinError(f"{', '.join(map(str, there))}: there already. Move it away, or choose another folder.")
    for view in VIEWS:
        path = args.out / view.name
        write_atomic(path, view_text(view.read_text(encoding="utf-8"), args.namespace, args.frame_prefix))
        print(path)
    return 0
