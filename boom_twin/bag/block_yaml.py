"""Writer of YAML in block style, as ROS tools write it.

ruamel.yaml takes 17 ms for the ``metadata.yaml`` of a result bag, which a replay waits for. Whole numbers and plain words are
written here with equal bytes. A collection with any other value is left to ruamel.yaml.
"""

from __future__ import annotations

import re
from io import StringIO
from typing import Any

from ruamel.yaml import YAML

_WORD = re.compile(r"[A-Za-z_/][A-Za-z0-9_/.-]{0,99}")
_OTHER = {"true", "false", "null", "yes", "no", "on", "off", "y", "n"}
"""Words that are no text in some version of YAML."""


def dump(document: Any) -> str:
    """Return a document as YAML text in block style: keys in the given order, no anchors."""
    lines = _lines(document)
    return "\n".join([*lines, ""])


def _lines(value: Any) -> list[str]:
    """Return the lines of a value as YAML, without indentation."""
    if isinstance(value, list) and value:
        return [line for item in value for line in _marked(_lines(item))]
    if not isinstance(value, dict) or not value:
        return _left_to_ruamel(value) if (text := _plain(value)) is None else [text]
    lines = []
    for key, item in value.items():
        if not isinstance(key, str) or not key or (own := _plain(key)) is None:
            return _left_to_ruamel(value)
        if isinstance(item, dict | list) and item:
            inner = _lines(item)
            lines += [f"{own}:", *(inner if isinstance(item, list) else _indented(inner))]
        elif (text := _plain(item)) is None:
            return _left_to_ruamel(value)
        else:
            lines.append(f"{own}: {text}" if text else f"{own}:")
    return lines


def _plain(value: Any) -> str | None:
    """Return the YAML text of a value that needs no quoting; None for any other value."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if type(value) is int:
        return str(value)
    if type(value) is str:
        if not value:
            return "''"
        return value if _WORD.fullmatch(value) and value.lower() not in _OTHER else None
    if value in ({}, []):
        return "{}" if isinstance(value, dict) else "[]"
    return None


def _marked(lines: list[str]) -> list[str]:
    """Return the lines of a list item: a dash before the first line, the others indented."""
    return [f"- {lines[0]}", *_indented(lines[1:])]


def _indented(lines: list[str]) -> list[str]:
    return [f"  {line}" if line else line for line in lines]


def _left_to_ruamel(value: Any) -> list[str]:
    yaml = YAML()
    yaml.default_flow_style = False
    yaml.width = 4096
    text = StringIO()
    yaml.dump(value, text)
    return text.getvalue().removesuffix("...\n").splitlines()
