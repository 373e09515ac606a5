"""Read untrusted YAML text to plain values with their lines, within limits; edit single values and keep all other text."""

from __future__ import annotations

import json
from collections.abc import Iterable
from copy import deepcopy
from dataclasses import dataclass, field
from functools import lru_cache
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.composer import Composer
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode
from ruamel.yaml.scalarstring import LiteralScalarString
from ruamel.yaml.util import load_yaml_guess_indent

from ..errors import BoomTwinError, Fault, FaultKind
from ..system.files import open_received
from ..system.terminal_text import printable

LARGEST_FILE = 4 * 2**20  # bytes, size limit of a file that is read
MOST_VALUES = 50_000  # number of values in a file at most, with aliases expanded
DEEPEST = 20

TAG = "tag:yaml.org,2002:"
TYPED = {"int": "whole number", "float": "number", "bool": "true or false", "null": "empty value"}
"""Kinds of scalars other than text, with their names for messages."""
Place = tuple[str | int, ...]


def read_plain(path: Path, failure: type[BoomTwinError], remedy: str, received: bool = False) -> Any:
    """Return the values of a YAML file. Raise `failure` with path, reason and remedy if it cannot be read.

    `received` is True for a file in a received folder, see `boom_twin.system.files.open_received`.
    """
    try:
        with open_received(path) if received else path.open("rb") as stream:
            data = stream.read(LARGEST_FILE + 1)
        if len(data) > LARGEST_FILE:
            raise ValueError(f"more than {LARGEST_FILE} bytes")
        return plain(data.decode("utf-8-sig"))
    except OSError as error:
        raise failure(f"{path}: {error.strerror}. {remedy}") from None
    except ValueError as error:
        raise failure(f"{path}: not a readable YAML file ({error}). {remedy}") from None


def plain(text: str) -> Any:
    """Return the values of a YAML text: dict, list, str, int, float, bool or None; None for an empty text.

    Raise ValueError if it is not YAML, has a value with a tag, a merge key, or a key twice, holds more than `MOST_VALUES`
    values, or is nested deeper than `DEEPEST`.
    """
    return deepcopy(_plain(text))


@lru_cache(4)  # several readers of a session look into its metadata
def _plain(text: str) -> Any:
    try:
        reader = YamlReader(text, list)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    except YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None
    if reader.document.faults:
        raise ValueError(str(reader.document.faults[0]))
    return reader.document.values


def words(place: Place) -> str:
    """Return a place in the words of the file: ``sections[1].root.mass``; line ends in a key are shown as escapes."""
    text = ""
    for step in place:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return printable(text, keep="") or "scene"


@dataclass
class Document:
    """Values of a text, line (from 1) of the places in it, and what was wrong with the writing."""

    values: Any = None
    lines: dict[Place, int] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)

    def line(self, place: Place) -> int | None:
        """Return the line of a place; of the nearest block around it if the place itself is not in the text."""
        while place not in self.lines and place:
            place = place[:-1]
        return self.lines.get(place)

    def written(self, place: Place) -> Any:
        """Return the value at a place as it stands in the text, for example with its unit; None where there is none."""
        value = self.values
        for step in place:
            try:
                value = value[step]
            except (KeyError, IndexError, TypeError):
                return None
        return value

    def fault(self, place: Place, value: Any, bound: str, remedy: str, kind: FaultKind = "fault") -> Fault:
        """Return a fault or a warning at a place of this text."""
        return Fault(words(place), value, bound, remedy, self.line(place), kind)


class YamlReader:
    """Reader of an untrusted YAML text to a `Document` of plain values.

    No tag of the text can make an object: mappings become dict, sequences become `sequence`, scalars become float, int, bool,
    str or None. What is YAML but not allowed here is in ``document.faults``. Raise YAMLError, RecursionError or ValueError if
    the text is not YAML, holds more than `MOST_VALUES` values, or is nested too deeply.
    """

    def __init__(self, text: str, sequence: type[list[Any]] | type[tuple[Any, ...]]) -> None:
        yaml = YAML(typ="safe", pure=True)
        yaml.Composer = BoundedComposer
        root = yaml.compose(text)
        self.document, self.is_empty = Document(), root is None
        self._sequence, self._constructor, self._count = sequence, yaml.constructor, 0
        if root is not None:
            self.document.values = self._value(root, ())

    def text(self, node: ScalarNode, place: Place) -> Any:
        """Return the value of a scalar that YAML takes for text."""
        return node.value

    def fault(self, place: Place, value: Any, bound: str, remedy: str) -> None:
        self.document.faults.append(self.document.fault(place, value, bound, remedy))

    def _value(self, node: Node, place: Place) -> Any:
        self._count += 1
        self.document.lines.setdefault(place, node.start_mark.line + 1)
        if len(place) > DEEPEST or self._count > MOST_VALUES:
            if self._count <= MOST_VALUES + 1:
                bound = f"nested too deeply, or too many values (more than {MOST_VALUES} with aliases)"
                self.fault(place, "...", bound, "Write it without aliases that hold themselves.")
            return None
        if isinstance(node, ScalarNode):
            return self._scalar(node, place)
        if node.tag not in (TAG + "map", TAG + "seq"):
            self._refuse_tag(node, place)
        if isinstance(node, MappingNode):
            return self._mapping(node, place)
        return self._sequence(self._value(item, (*place, i)) for i, item in enumerate(node.value))

    def _mapping(self, node: MappingNode, place: Place) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key_node, value_node in node.value:
            key = str(key_node.value) if isinstance(key_node, ScalarNode) else "?"
            here = (*place, key)
            line = key_node.start_mark.line + 1
            if not isinstance(key_node, ScalarNode) or key_node.tag == TAG + "merge":
                self.fault(here, "...", "this kind of key is not used here", "Write plain keys.")
            elif key in found:
                bound = f"the key is there twice, on line {self.document.lines[here]} and on line {line}"
                self.fault(here, found[key], bound, "Keep one of them.")
            else:
                self.document.lines[here] = line
                found[key] = self._value(value_node, here)
        return found

    def _scalar(self, node: ScalarNode, place: Place) -> Any:
        kind = str(node.tag).removeprefix(TAG)
        if kind not in TYPED:
            if kind in ("str", "timestamp"):
                return self.text(node, place)
            self._refuse_tag(node, place)
            return node.value
        try:
            return self._constructor.construct_object(node)
        except (ArithmeticError, LookupError, TypeError, ValueError, YAMLError):
            self.fault(place, node.value, f"this is no {TYPED[kind]}", "Write the value alone, without a tag.")
            return node.value

    def _refuse_tag(self, node: Node, place: Place) -> None:
        value = node.value if isinstance(node, ScalarNode) else "..."
        self.fault(place, value, f"the tag {node.tag} is not allowed", "Remove the tag: only plain values are read.")


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
        """Return the next node. Raise YAMLError after `MOST_VALUES` nodes."""
        self.nodes += 1
        if self.nodes > MOST_VALUES:
            raise YAMLError(f"more than {MOST_VALUES} values")
        return super().compose_node(parent, index)


def with_values(text: str, changes: Iterable[tuple[Place, Any]]) -> str:
    """Return the text with other plain values by place; None removes a key. Missing blocks on the way to a place are added.

    Comments stay, except those behind a removed key; lines in braces are wrapped anew.
    """
    line_width = 120  # characters of a line in an edited text
    yaml, stream = YAML(), StringIO()
    yaml.preserve_quotes, yaml.width = True, line_width
    root, indent, offset = load_yaml_guess_indent(text, yaml=yaml)
    if root is None:
        root = CommentedMap()
        stream.write(text)  # comments alone
    for place, value in changes:
        _change(root, place, value)
    yaml.indent(mapping=2, sequence=indent or 2, offset=offset or 0)
    yaml.dump(root, stream)
    return stream.getvalue()


def _change(block: Any, place: Place, value: Any) -> None:
    key, rest = place[0], place[1:]
    is_there = isinstance(key, int) or key in block
    if rest and is_there and block[key] is not None:
        _change(block[key], rest, value)
    elif value is None:
        block.pop(key, None)
    else:
        for step in reversed(rest):
            value = {step: value}
        block[key] = _rounded(value)


def _rounded(value: Any) -> Any:
    """Return a value with six digits in its numbers, and a text of several lines as a block."""
    if isinstance(value, dict):
        return CommentedMap((key, _rounded(item)) for key, item in value.items())
    if isinstance(value, list | tuple):
        return CommentedSeq(map(_rounded, value))
    if isinstance(value, str):
        return LiteralScalarString(value) if "\n" in value else value
    return float(f"{value:.6g}") if isinstance(value, float) else value


def whole_text(values: Any) -> str:
    """Return plain values as the text of a YAML file, with keys in their order and innermost blocks in braces."""
    stream = StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.dump(values, stream)
    return stream.getvalue()


def yaml_text(value: Any) -> str:
    """Return a value as YAML in one line, with six digits."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {yaml_text(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(yaml_text, value)) + "]"
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False)
    return f"{value:.6g}" if isinstance(value, float) else str(value)
