"""`boom_twin scene`: the default scene file, as it stands or with play in its pins."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace

from ..scene.load import clearance_text, default_text


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--clearance", action="store_true", help="with play in the pins between rods and boom")


def run(args: Namespace) -> int:
    """Print the file."""
    sys.stdout.write(default_text())
    if args.clearance:
        sys.stdout.write("\n" + clearance_text())
    return 0
