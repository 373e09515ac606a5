"""What several commands share: the scene argument, and JSON on stdout."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import Fault

if TYPE_CHECKING:
    from ..io.reader import Session
    from ..io.session_model import SessionScene
    from ..scene import Scene


def add_scene(parser: ArgumentParser) -> None:
    """The scene file, as a positional argument; without it, the default scene."""
    parser.add_argument("scene", nargs="?", metavar="SCENE", help="scene file (YAML); without it, the default scene")


def add_session_scene(parser: ArgumentParser) -> None:
    """``--scene`` of a command that reads a session; see `open_session_scene`."""
    told = "scene file (YAML); without it, the one that the session was made with, else the default scene"
    parser.add_argument("--scene", metavar="SCENE", help=told)


def add_json(parser: ArgumentParser) -> None:
    """``--json``: stdout holds exactly one flat JSON object."""
    parser.add_argument("--json", action="store_true", help="print one flat JSON object on stdout, nothing else there")


def open_scene(source: str | None) -> Scene:
    """The scene of an argument; its warnings go to stderr, one line each."""
    from ..scene.load import examine  # not for commands that open no scene

    scene, oddities = examine(source)
    tell(oddities, source)
    return scene


def open_session_scene(session: str | Path, source: str | None) -> SessionScene:
    """The scene of a session, see `boom_twin.io.session_model.scene_of`; which was taken goes to stderr, with its warnings."""
    from ..io.session_model import scene_of

    found = scene_of(Path(session), source)
    print(f"scene: {found.source} (sha256 {found.sha256[:12]}..)", file=sys.stderr)
    tell(found.oddities, found.source)
    return found


def tell(oddities: Iterable[Fault], source: str | None) -> None:
    """Print warnings on stderr, with the file that they are about."""
    for oddity in oddities:
        print(f"warning: {source}: {oddity}", file=sys.stderr)


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
