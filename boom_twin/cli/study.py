"""``boom_twin study``: reports on the methods: error against run time, and others."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from .arguments import add_scene, files_of
from .output import open_scene

KINDS = {
    "error": "compare error against run time of all methods and of Exudyn (extra peers)",
    "stability": "find where each method holds, degrades or fails on stiff and extreme cases",
    "parts": "measure the run time of every part of a model, and the effect of leaving it out",
}
"""Purpose of each module in `boom_twin.validation.study` that has ``write(scene, out, quick, posture) -> paths``."""


def add_arguments(parser: ArgumentParser) -> None:
    kinds = parser.add_subparsers(dest="kind", metavar="KIND", required=True)
    for name, purpose in KINDS.items():
        own = kinds.add_parser(name, help=purpose, description=purpose[0].upper() + purpose[1:] + ".")
        add_scene(own)
        place = "folder for tables, numbers and pictures: new, empty, or of an earlier study of this kind"
        own.add_argument("--out", required=True, metavar="DIR", help=place)
        own.add_argument("--posture", metavar="NAME", help="posture where the motion starts (default: arch, or the first)")
        own.add_argument("--quick", action="store_true", help="run a few cases on a short motion")


def run(args: Namespace) -> int:
    from ..system.result_folder import result_folder, study

    write: Callable[..., list[Path]] = import_module(f"boom_twin.validation.study.{args.kind}").write
    scene, out = open_scene(args.scene), Path(args.out)
    with result_folder(out, study(args.kind), files_of(args, "scene")) as building:
        written = write(scene, building, quick=args.quick, posture=args.posture)
    for path in written:
        print(out / path.name)
    return 0
