"""`boom_twin init`: a first scene from a table of the drawing's dimensions."""

from __future__ import annotations

import shlex
import sys
from argparse import ArgumentParser, Namespace
from importlib.resources import files
from pathlib import Path

from ..errors import UsageError
from ..scene.boom_table import read_table
from ..scene.first_scene import first_scene
from ..system.files import check_new, write_atomic
from .output import tell_oddities


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--table", metavar="FILE", type=Path, help="table of dimensions, as --example-table prints it")
    parser.add_argument("--force", action="store_true", help="overwrite an existing scene")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--out", metavar="SCENE", type=Path, help="scene file to write; without --force it must not exist")
    what.add_argument("--example-table", action="store_true", help="print a table to start from, and exit")


def run(args: Namespace) -> int:
    if args.example_table:
        sys.stdout.write((files("boom_twin") / "msg_config" / "boom_table.yaml").read_text(encoding="utf-8"))
        return 0
    if args.table is None:
        raise UsageError("--table is not given. Name a table of dimensions; --example-table prints one to start from.")
    check_new(args.out, [args.table], args.force)
    table, document = read_table(args.table)
    source = str(args.table)
    text, scene, oddities = first_scene(table, document, source)
    write_atomic(args.out, text)
    tell_oddities(oddities, source)
    count = len(scene.sections)
    size = f"{count} section{'s' * (count > 1)}, {scene.reach:.2f} m"
    print(f"Written: {args.out}, {size}. {_next(args.out, source, len(oddities))}")
    return 0


def _next(scene: Path, source: str, warnings: int) -> str:
    if not warnings:
        picture = str(scene.with_suffix(".png"))
        check = shlex.join(["boom_twin", "check", str(scene), "--strict", "--picture", picture])
        return f"Next: {check}, and look at {picture}."
    again = shlex.join(["boom_twin", "init", "--table", source, "--out", str(scene), "--force"])
    return f"Next: mend {source} where it is warned of, then {again}"
