"""The state of one component, as REP-107 has it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum


class Level(IntEnum):
    """How a component is; the numbers are those of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class Status:
    """State of one component.

    Attributes
    ----------
    name : str
        Without the node's.
    level : Level
    message : str
        One line.
    values : dict of str to str, int or float
        Units are at the end of the keys.
    """

    name: str
    level: Level
    message: str
    values: Mapping[str, str | int | float] = field(default_factory=dict)
