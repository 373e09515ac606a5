"""What several commands share: the scene argument, and JSON on stdout."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..errors import Fault

if TYPE_CHECKING:
    from ..io.reader import Session
    from ..scene import Scene


def add_scene(parser: ArgumentParser, *, option: bool = False) -> None:
    """The scene file: a positional argument, or ``--scene``; without it, the default scene."""
    names = ["--scene"] if option else ["scene"]
    extra: dict[str, Any] = {} if option else {"nargs": "?"}
    parser.add_argument(*names, metavar="SCENE", help="scene file (YAML); without it, the default scene", **extra)


def add_json(parser: ArgumentParser) -> None:
    """``--json``: stdout holds exactly one flat JSON object."""
    parser.add_argument("--json", action="store_true", help="print one flat JSON object on stdout, nothing else there")


def open_scene(source: str | None) -> Scene:
    """The scene of an argument; its warnings go to stderr, one line each."""
    from ..scene.load import examine  # not for commands that open no scene

    scene, oddities = examine(source)
    tell(oddities)
    return scene


def tell(oddities: list[Fault]) -> None:
    """Print warnings on stderr."""
    for oddity in oddities:
        print(f"warning: {oddity}", file=sys.stderr)


def warn_incomplete(session: Session) -> None:
    """Say on stderr if a session is not whole."""
    if session.incomplete:
        print(f"warning: {session.path}: {session.incomplete}", file=sys.stderr)


def print_json(values: Mapping[str, Any]) -> None:
    """Print one flat JSON object; a number that is not finite becomes null."""
    print(json.dumps({key: _plain(value) for key, value in values.items()}, allow_nan=False))


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        raise TypeError("the object must be flat")
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and value - value != 0.0:
        return None
    return value
