"""Reads a ROS parameter file, and checks values against a table of parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from .errors import UsageError
from .plain import read_plain

Table = TypeVar("Table", bound=BaseModel)


def read_parameters(path: Path) -> dict[str, Any]:
    """Names and values of a ROS parameter file (``/**: ros__parameters:``); UsageError if it is none."""
    content = read_plain(path, UsageError, "Give a ROS parameter file.")
    try:
        return dict(next(iter(content.values()))["ros__parameters"])
    except (AttributeError, KeyError, TypeError, StopIteration, ValueError):
        raise UsageError(f"{path}: not a ROS parameter file. It needs `/**:` with `ros__parameters:` below.") from None


def checked(table: type[Table], values: dict[str, Any], source: str) -> Table:
    """A table with these values; UsageError names every value that is out of bounds."""
    try:
        return table(**values)
    except ValidationError as error:
        lines = [f"{'.'.join(map(str, e['loc']))} = {e['input']!r}: {e['msg']}" for e in error.errors()]
        known = ", ".join(table.model_fields)
        raise UsageError(f"{source}: " + "; ".join(lines) + f". Known parameters: {known}.") from None
