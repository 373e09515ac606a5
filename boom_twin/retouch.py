"""Single values of a YAML text set, added or taken out: all else of the text stays, comments and layout too."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, cast

from ruamel.yaml import YAML
from ruamel.yaml.nodes import CollectionNode, MappingNode, Node, SequenceNode

Place = Sequence[str | int]
Pair = tuple[Node, Node]


def with_value(text: str, place: Place, value: Any) -> str:
    """The text with another value at `place`; blocks on the way to it that are not there are made.

    Parameters
    ----------
    value : bool, int, float, str or dict of these
        None takes the key out.
    """
    root = YAML(typ="safe", pure=True).compose(text)
    block, depth = _deepest(root, place)
    key, rest = place[depth], place[depth + 1 :]
    pairs: list[Pair] = block.value
    names = [str(name.value) for name, _ in pairs]
    if value is None:
        return _removed(text, block, names.index(str(key))) if key in names and not rest else text
    for step in reversed(rest):
        value = {step: value}
    if key not in names:
        return _inserted(text, block, f"{key}: {yaml_text(value)}")
    name, node = pairs[names.index(str(key))]
    start, end = int(node.start_mark.index), _end(text, node)
    if start < int(node.end_mark.index):
        return text[:start] + yaml_text(value) + text[end:]
    colon = text.index(":", int(name.end_mark.index)) + 1  # nothing stands there: its mark lies further on
    return f"{text[:colon]} {yaml_text(value)}{text[colon:]}"


def yaml_text(value: Any) -> str:
    """A value in the spelling of YAML, six digits; a text of several lines as a block for the outermost mapping."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {yaml_text(item)}" for key, item in value.items()) + "}"
    if isinstance(value, str) and "\n" in value:
        return "|2-\n" + "\n".join(f"  {line}".rstrip() for line in value.split("\n"))
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _deepest(node: Node, place: Place) -> tuple[MappingNode, int]:
    """The last mapping on the way to a place, and how many steps lead to it."""
    found, depth, inner = cast(MappingNode, node), 0, cast(Node | None, node)
    for taken, step in enumerate(place[:-1], start=1):
        if isinstance(inner, MappingNode):
            inner = next((value for key, value in inner.value if key.value == step), None)
        elif isinstance(inner, SequenceNode) and isinstance(step, int):
            inner = inner.value[step]
        if isinstance(inner, MappingNode):
            found, depth = inner, taken
    return found, depth


def _inserted(text: str, block: MappingNode, line: str) -> str:
    """A key added: at the end of a block in braces, else above its first key."""
    if block.flow_style and not block.value:
        return f"{text[: block.start_mark.index]}{{{line}}}{text[block.end_mark.index :]}"
    if block.flow_style:
        end = _end(text, block.value[-1][1])
        return f"{text[:end]}, {line}{text[end:]}"
    mark = block.value[0][0].start_mark
    return f"{text[: mark.index]}{line}\n{' ' * mark.column}{text[mark.index :]}"


def _removed(text: str, block: MappingNode, number: int) -> str:
    """A key taken out with its value; in a block without braces, with the rest of its line."""
    pairs: list[Pair] = block.value
    start, end = pairs[number][0].start_mark.index, _end(text, pairs[number][1])
    if number == 0:
        return text[:start] + text[pairs[1][0].start_mark.index :]
    if block.flow_style:
        return text[: _end(text, pairs[number - 1][1])] + text[end:]
    line_end = text.find("\n", end)
    return text[: text.rfind("\n", 0, start) + 1] + (text[line_end + 1 :] if line_end >= 0 else "")


def _end(text: str, node: Node) -> int:
    """Where the text of a node ends; the mark of a block without braces lies behind the comments that follow it."""
    if not isinstance(node, CollectionNode):
        start = int(node.start_mark.index)
        return start + len(text[start : node.end_mark.index].rstrip())
    if node.flow_style or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _end(text, last[1] if isinstance(node, MappingNode) else last)
