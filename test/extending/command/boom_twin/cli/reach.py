"""`boom_twin reach`: how far a boom reaches."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from .arguments import add_json, add_scene
from .output import open_scene, print_result


def add_arguments(parser: ArgumentParser) -> None:
    """The scene, and the form of the answer."""
    add_scene(parser)
    add_json(parser)


def run(args: Namespace) -> int:
    """Print the distance from the base pivot to the tip of the straight boom."""
    reach = open_scene(args.scene).reach
    print_result(args.json, {"reach_m": reach}, [f"{reach:.3f} m"])
    return 0
