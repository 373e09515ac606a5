"""`boom_twin scene`: the default scene file, as it stands."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace

from ..scene.load import default_text


def add_arguments(parser: ArgumentParser) -> None:
    """No arguments."""


def run(args: Namespace) -> int:
    """Print the file."""
    sys.stdout.write(default_text())
    return 0
