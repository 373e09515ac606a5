"""Read untrusted YAML text to plain values within limits, and edit single values of it with comments and layout kept."""

from __future__ import annotations

import json
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import Any, cast

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import CollectionNode, MappingNode, Node, ScalarNode, SequenceNode

from ..errors import BoomTwinError
from ..system.received_files import open_received

LARGEST = 4 * 2**20
"""Size limit of a file that is read, bytes."""
MOST = 50_000
"""Limit for the number of values in a file, with aliases expanded."""
DEEPEST = 30

TAG = "tag:yaml.org,2002:"
TYPED = {"int": "whole number", "float": "number", "bool": "true or false", "null": "empty value"}
"""Kinds of scalars other than text, with their names for messages."""


def read_plain(path: Path, failure: type[BoomTwinError], remedy: str, received: bool = False) -> Any:
    """Return the values of a YAML file. Raise `failure` with path, reason and remedy if it cannot be read.

    `received` is True for a file in a received folder, see `boom_twin.system.received_files.open_received`.
    """
    try:
        with open_received(path) if received else path.open("rb") as stream:
            data = stream.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise ValueError(f"more than {LARGEST} bytes")
        return plain(data.decode("utf-8-sig"))
    except OSError as error:
        raise failure(f"{path}: {error.strerror}. {remedy}") from None
    except ValueError as error:
        raise failure(f"{path}: not a readable YAML file ({error}). {remedy}") from None


def plain(text: str) -> Any:
    """Return the values of a YAML text: dict, list, str, int, float, bool or None; None for an empty text.

    Raises
    ------
    ValueError
        It is not YAML; it has a value with a tag, a merge key, or a key twice; it holds more than `MOST` values, or is
        nested deeper than `DEEPEST`.
    """
    try:
        root, constructor = bounded_nodes(text)
        return None if root is None else _Values(constructor).of(root, 0)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    except YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None


def bounded_nodes(text: str) -> tuple[Node | None, Any]:
    """Return the root node of an untrusted YAML text (None if empty) and the constructor of its scalars.

    Raises
    ------
    YAMLError, RecursionError, ValueError
        It is not YAML, holds more than `MOST` values, or is nested too deeply.
    """
    yaml = YAML(typ="safe", pure=True)
    yaml.Composer = BoundedComposer
    return yaml.compose(text), yaml.constructor


class BoundedComposer(Composer):
    """Composer that refuses YAML other than 1.2 and too many nodes, because a node takes 100 times the memory of its text."""

    nodes = 0

    def __init__(self, loader: Any = None) -> None:
        super().__init__(loader)
        self.warn_double_anchors = False  # YAML allows them; the warning is one of Python

    def compose_document(self) -> Any:
        """Return the root of a YAML 1.2 document. YAML 1.1 is refused, because there `010` is 8 and `on` is true."""
        event = self.parser.peek_event()
        if event.version not in (None, (1, 2)):
            version = ".".join(map(str, event.version))
            problem = f"the directive %YAML {version}: files are read as YAML 1.2. Remove that line"
            raise MarkedYAMLError(problem=problem, problem_mark=event.start_mark)
        return super().compose_document()

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Return the next node. Raise YAMLError after `MOST` nodes."""
        self.nodes += 1
        if self.nodes > MOST:
            raise YAMLError(f"more than {MOST} values")
        return super().compose_node(parent, index)


class _Values:
    """Converter of nodes to values."""

    def __init__(self, constructor: Any) -> None:
        self._constructor, self._count = constructor, 0

    def of(self, node: Node, depth: int) -> Any:
        self._count += 1
        if self._count > MOST or depth > DEEPEST:
            raise ValueError(f"more than {MOST} values by aliases, or nested deeper than {DEEPEST}")
        if isinstance(node, MappingNode):
            return self._mapping(node, depth)
        if isinstance(node, ScalarNode):
            return self._scalar(node)
        return [self.of(item, depth + 1) for item in node.value]

    def _mapping(self, node: MappingNode, depth: int) -> dict[Any, Any]:
        found: dict[Any, Any] = {}
        for key_node, value_node in node.value:
            line = key_node.start_mark.line + 1
            if not isinstance(key_node, ScalarNode) or key_node.tag == TAG + "merge":
                raise ValueError(f"line {line}: a key that is not plain")
            key = self._scalar(key_node)
            if key in found:
                raise ValueError(f"line {line}: key {key} stands there twice")
            found[key] = self.of(value_node, depth + 1)
        return found

    def _scalar(self, node: ScalarNode) -> Any:
        kind = str(node.tag).removeprefix(TAG)
        if kind in TYPED:
            return typed_value(self._constructor, node)
        if kind not in ("str", "timestamp"):
            raise ValueError(f"line {node.start_mark.line + 1}: the tag {node.tag}, which is not allowed")
        return node.value


def typed_value(constructor: Any, node: ScalarNode) -> Any:
    """Return the value of a scalar of a kind in `TYPED`. Raise ValueError if its text does not fit, as in ``!!bool maybe``."""
    try:
        return constructor.construct_object(node)
    except (ArithmeticError, LookupError, TypeError, ValueError, YAMLError):
        kind, line = str(node.tag).removeprefix(TAG), node.start_mark.line + 1
        raise ValueError(f"line {line}: {node.value[:40]!r}, which is no {TYPED[kind]}") from None


Place = Sequence[str | int]
Pair = tuple[Node, Node]


def with_value(text: str, place: Place, value: Any) -> str:
    """Return the text with another value at `place`. Missing blocks on the way to it are added.

    Parameters
    ----------
    value : bool, int, float, str or dict of these
        New value; None removes the key.
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


def whole_text(values: Any) -> str:
    """Return plain values as the text of a YAML file, with keys in their order and innermost blocks in braces."""
    stream = StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.dump(values, stream)
    return stream.getvalue()


def yaml_text(value: Any) -> str:
    """Return a value as YAML with six digits. A text of several lines becomes a block for the outermost mapping."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {yaml_text(item)}" for key, item in value.items()) + "}"
    if isinstance(value, str) and "\n" in value:
        return "|2-\n" + "\n".join(f"  {line}".rstrip() for line in value.split("\n"))
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _deepest(node: Node, place: Place) -> tuple[MappingNode, int]:
    """Return the last existing mapping on the way to a place, and the number of steps to it."""
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
    """Return the text with a key added at the end of a block in braces, else above its first key."""
    if block.flow_style and not block.value:
        return f"{text[: block.start_mark.index]}{{{line}}}{text[block.end_mark.index :]}"
    if block.flow_style:
        end = _end(text, block.value[-1][1])
        return f"{text[:end]}, {line}{text[end:]}"
    mark = block.value[0][0].start_mark
    return f"{text[: mark.index]}{line}\n{' ' * mark.column}{text[mark.index :]}"


def _removed(text: str, block: MappingNode, number: int) -> str:
    """Return the text without a key and its value. In a block without braces, the rest of the line is removed, too."""
    pairs: list[Pair] = block.value
    start, end = pairs[number][0].start_mark.index, _end(text, pairs[number][1])
    if number == 0:
        return text[:start] + text[pairs[1][0].start_mark.index :]
    if block.flow_style:
        return text[: _end(text, pairs[number - 1][1])] + text[end:]
    line_end = text.find("\n", end)
    return text[: text.rfind("\n", 0, start) + 1] + (text[line_end + 1 :] if line_end >= 0 else "")


def _end(text: str, node: Node) -> int:
    """Return the end of the text of a node. The end mark of a block without braces lies after the comments that follow it."""
    if not isinstance(node, CollectionNode):
        start = int(node.start_mark.index)
        return start + len(text[start : node.end_mark.index].rstrip())
    if node.flow_style or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _end(text, last[1] if isinstance(node, MappingNode) else last)
