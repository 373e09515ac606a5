"""`boom_twin urdf`: a scene as a URDF, for robot_state_publisher."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace

from .arguments import add_scene
from .output import open_scene


def add_arguments(parser: ArgumentParser) -> None:
    add_scene(parser)


def run(args: Namespace) -> int:
    from ..messages.urdf import urdf

    sys.stdout.write(urdf(open_scene(args.scene)))
    return 0
