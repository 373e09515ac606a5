"""`boom_twin scene`: the default scene file, as it stands or with play in its pins."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace

from ..scene.load import clearance_text, default_text
from ..scene.yaml_reader import with_end_mark


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--clearance", action="store_true", help="with play in the pins between rods and boom")


def run(args: Namespace) -> int:
    """Print the file."""
    text = default_text()
    sys.stdout.write(with_end_mark(f"{text}\n{clearance_text()}") if args.clearance else text)
    return 0
