"""`boom_twin reach`: how far a boom reaches."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from .main import add_json, add_scene, open_scene, print_json


def add_arguments(parser: ArgumentParser) -> None:
    """The scene, and the form of the answer."""
    add_scene(parser)
    add_json(parser)


def run(args: Namespace) -> int:
    """Print the distance from the base pivot to the tip of the straight boom."""
    reach = open_scene(args.scene).reach
    if args.json:
        print_json({"reach_m": reach})
    else:
        print(f"{reach:.3f} m")
    return 0
