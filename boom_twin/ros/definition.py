"""The definition of any installed message type, as a bag needs it."""

from __future__ import annotations

import re
from typing import Any

from ..errors import UsageError
from ..io.typestore import jazzy
from .types import message_class

_BASE = {"double": "float64", "float": "float32", "boolean": "bool", "octet": "byte"}
_ARRAY = re.compile(r"^(?P<element>.+)\[(?P<count>\d+)\]$")
_SEQUENCE = re.compile(r"^sequence<(?P<element>[^,]+)(?:, (?P<bound>\d+))?>$")
_STRING = re.compile(r"^(?P<kind>w?string)<(?P<bound>\d+)>$")
_EMPTY = "uint8 structure_needs_at_least_one_member\n"  # what an empty message holds in CDR
_RULE = "=" * 80


def installed_class(type_name: str) -> Any:
    """The class of ``package/msg/Name`` (``package/Name`` will do).

    Raises
    ------
    UsageError
        It is not installed, or is no message type.
    """
    parts = type_name.split("/")
    full = f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 else type_name
    try:
        return message_class(full)
    except (ImportError, AttributeError, ValueError) as error:
        raise UsageError(
            f"type {type_name!r}: not an installed message type ({error}). Write package/msg/Name, and install the "
            "package or source its workspace."
        ) from error


def full_name(kind: Any) -> str:
    """``package/msg/Name`` of a class."""
    package, folder = kind.__module__.split(".")[:2]
    return f"{package}/{folder}/{kind.__name__}"


def definition_of(kind: Any) -> str:
    """The text of a class and of all types in it; fields only where ROS 2 Jazzy's own packages do not have it."""
    name = full_name(kind)
    if name in jazzy().types:
        return str(jazzy().generate_msgdef(name, ros_version=2)[0])
    texts: dict[str, str] = {}
    waiting = [name]
    while waiting:
        current = waiting.pop(0)
        if current not in texts:
            texts[current], inner = _fields(message_class(current))
            waiting += inner
    first, *others = texts
    return texts[first] + "".join(f"{_RULE}\nMSG: {_short(other)}\n{texts[other]}" for other in others)


def _fields(kind: Any) -> tuple[str, list[str]]:
    """One line for each field, and the types in them."""
    lines, inner = [], []
    for name, described in kind.get_fields_and_field_types().items():
        text, used = _spelled(described)
        lines.append(f"{text} {name}\n")
        inner += [f"{used.split('/')[0]}/msg/{used.split('/')[1]}"] if "/" in used else []
    return "".join(lines) or _EMPTY, inner


def _spelled(described: str) -> tuple[str, str]:
    """A field's type in the words of a .msg file, and its element."""
    if match := _ARRAY.match(described):
        element = _element(match["element"])
        return f"{element}[{match['count']}]", element
    if match := _SEQUENCE.match(described):
        element = _element(match["element"])
        return f"{element}[{'<=' + match['bound'] if match['bound'] else ''}]", element
    element = _element(described)
    return element, element


def _element(described: str) -> str:
    if match := _STRING.match(described):
        return f"{match['kind']}<={match['bound']}"
    return _BASE.get(described, described)


def _short(name: str) -> str:
    return name.replace("/msg/", "/")
