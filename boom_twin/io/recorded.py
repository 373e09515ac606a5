"""A topic as it stands in a bag, whatever its type."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Recorded:
    """One topic as it stands in a bag.

    Attributes
    ----------
    topic, type : str
        Absolute name; ``package/msg/Name``.
    definition : bytes
        Of the type and all types in it, in the language that `definition_encoding` names.
    details : dict of str to str
        Kept with the channel.
    qos : object
        Offered profiles, for ``metadata.yaml``.
    type_hash : str
    encoding, definition_encoding : str
    """

    topic: str
    type: str
    definition: bytes
    details: Mapping[str, str] = field(default_factory=dict)
    qos: Any = ()
    type_hash: str = ""
    encoding: str = "cdr"
    definition_encoding: str = "ros2msg"
