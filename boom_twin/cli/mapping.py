"""`boom_twin mapping`: the default mapping of topics and sensors, with its comments."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace


def add_arguments(parser: ArgumentParser) -> None:
    """Declare no arguments."""


def run(args: Namespace) -> int:
    """Print the default mapping."""
    from ..messages.topic_table import DEFAULT_FILE

    sys.stdout.write(DEFAULT_FILE.read_text(encoding="utf-8"))
    return 0
