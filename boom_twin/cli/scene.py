"""`boom_twin scene`: the default scene file, as it stands or with play in its pins, or an example."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace

from ..scene.load import clearance_text, default_text, example_names, example_text, with_end_mark


def add_arguments(parser: ArgumentParser) -> None:
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--clearance", action="store_true", help="scene with play in the pins between rods and boom")
    which.add_argument("--example", metavar="NAME", choices=example_names(), help=f"another boom: {', '.join(example_names())}")


def run(args: Namespace) -> int:
    text = default_text() if args.example is None else example_text(args.example)
    sys.stdout.write(with_end_mark(f"{text}\n{clearance_text()}") if args.clearance else text)
    return 0
