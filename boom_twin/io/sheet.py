"""``session.yaml``: what a recording was made with, beside its bag."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ruamel.yaml.scalarstring import LiteralScalarString

from .bagmeta import dump

FILE_NAME = "session.yaml"
_HEAD = "# What this session was recorded with. scene_sha256 is of the text under scene (UTF-8).\n"


@dataclass(frozen=True, slots=True)
class Sheet:
    """What a recording was made with.

    Attributes
    ----------
    version : str
        Of this package.
    scene, parameters, mapping : str
        Text of the scene file, of the ROS parameter file, and of the file that names topics and sensors.
    topics : dict of str to str or None
        Type by topic that is to be recorded; None where it was not known at the start.
    note, origin : str or None
        Of the operator.
    """

    version: str
    scene: str
    parameters: str
    mapping: str
    topics: Mapping[str, str | None]
    note: str | None = None
    origin: str | None = None

    def write(self, directory: Path) -> None:
        """Write ``session.yaml`` beside the bag."""
        document = {
            "boom_twin": self.version,
            "started": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "origin": self.origin,
            "note": self.note,
            "topics": dict(self.topics),
            "scene_sha256": hashlib.sha256(self.scene.encode()).hexdigest(),
            "scene": LiteralScalarString(self.scene),
            "parameters": LiteralScalarString(self.parameters),
            "mapping": LiteralScalarString(self.mapping),
        }
        (directory / FILE_NAME).write_text(_HEAD + dump(document), encoding="utf-8")
