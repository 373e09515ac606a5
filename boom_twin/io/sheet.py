"""``session.yaml``: what a recording was made with, beside its bag."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from ruamel.yaml.scalarstring import LiteralScalarString

from .atomic import write_atomic
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
    twin : dict of str to object
        The parameters of the running twin; empty as long as there is none.
    started : datetime
    """

    version: str
    scene: str
    parameters: str
    mapping: str
    topics: Mapping[str, str | None]
    note: str | None = None
    origin: str | None = None
    twin: Mapping[str, object] = field(default_factory=dict)
    started: datetime = field(default_factory=lambda: datetime.now(UTC))

    def write(self, directory: Path, counts: Sequence[Mapping[str, str | int | None]] | None = None) -> None:
        """Write ``session.yaml`` beside the bag, all of it or nothing.

        Parameters
        ----------
        directory : Path
        counts : sequence of dict, optional
            At the end: each topic with what became of its messages; None is unknown. A recording that was killed has none.

        Raises
        ------
        BagError
            The disk is full or fails.
        """
        end = {} if counts is None else {"ended": _time(datetime.now(UTC)), "counts": [dict(each) for each in counts]}
        document = {
            "boom_twin": self.version,
            "started": _time(self.started),
            **end,
            "origin": self.origin,
            "note": self.note,
            "topics": dict(self.topics),
            "twin": dict(self.twin),
            "scene_sha256": hashlib.sha256(self.scene.encode()).hexdigest(),
            "scene": LiteralScalarString(self.scene),
            "parameters": LiteralScalarString(self.parameters),
            "mapping": LiteralScalarString(self.mapping),
        }
        write_atomic(directory / FILE_NAME, _HEAD + dump(document))


def _time(moment: datetime) -> str:
    return moment.isoformat(timespec="milliseconds")
