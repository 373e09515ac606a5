"""``session.yaml``: what a recording was made with, beside its bag."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from ruamel.yaml.scalarstring import LiteralScalarString

from .. import __version__
from .bagmeta import dump

FILE_NAME = "session.yaml"
_HEAD = "# What this session was recorded with. scene_sha256 is of the text under scene (UTF-8).\n"


def write_sheet(
    directory: Path, scene: str, parameters: str, topics: Mapping[str, str | None], note: str | None, origin: str | None
) -> None:
    """Write ``session.yaml``.

    Parameters
    ----------
    directory : Path
        Of the bag.
    scene, parameters : str
        Text of the scene file and of the ROS parameter file.
    topics : dict of str to str or None
        Type by topic that is to be recorded; None where it was not known at the start.
    note, origin : str, optional
        Of the operator.
    """
    document = {
        "boom_twin": __version__,
        "started": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "origin": origin,
        "note": note,
        "topics": dict(topics),
        "scene_sha256": hashlib.sha256(scene.encode()).hexdigest(),
        "scene": LiteralScalarString(scene),
        "parameters": LiteralScalarString(parameters),
    }
    (directory / FILE_NAME).write_text(_HEAD + dump(document), encoding="utf-8")
