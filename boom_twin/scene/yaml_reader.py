"""Read a scene file: YAML text to plain values, with the line of each for error messages.

The text is composed to nodes and the nodes are turned into values here, so that no tag of the text can make an object:
mappings become dict, sequences become tuple, scalars become float, int, bool, str or None.

A line ``# end of scene`` shows that a file was not cut off, and a line in its head (`PROMISE`) says that it has one. Both are
comments, so that the file stays plain YAML. A file that promises the mark is refused without it; one that says nothing can be
used, with a warning.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode

from ..config.yaml_text import TAG, TYPED, bounded_nodes, typed_value
from ..errors import Fault, SceneError
from ..system.terminal_text import printable

Place = tuple[str | int, ...]

MAX_BYTES = 4_000_000
MAX_VALUES = 200_000
MAX_DEPTH = 20
SURROGATE = re.compile("[\ud800-\udfff]")
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def words(place: Place) -> str:
    """A place in the words of the file: ``sections[1].root.mass``; line ends in a key are shown as escapes."""
    text = ""
    for step in place:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return printable(text, keep="") or "scene"


@dataclass
class Document:
    """Values of a text, line (from 1) and cell of a spreadsheet of the places in it, and what was wrong with the writing."""

    values: Any = None
    lines: dict[Place, int] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)
    cells: dict[Place, str] = field(default_factory=dict)

    def line(self, place: Place) -> int | None:
        """Line of a place; of the nearest block around it if the place itself is not in the text."""
        while place not in self.lines and place:
            place = place[:-1]
        return self.lines.get(place)

    def written(self, place: Place) -> Any:
        """The value at a place as it stands in the text, for example with its unit; None where there is none."""
        value = self.values
        for step in place:
            try:
                value = value[step]
            except (KeyError, IndexError, TypeError):
                return None
        return value

    def fault(self, place: Place, value: Any, bound: str, remedy: str) -> Fault:
        """A fault at a place of this text."""
        return Fault(words(place) + self._cells_at(place), value, bound, remedy, self.line(place))

    def _cells_at(self, place: Place) -> str:
        """`` (cell C3)`` of a place, or of both its numbers; nothing of a block."""
        cells = [cell for own, cell in self.cells.items() if own[: len(place)] == place and len(own) - len(place) <= 1]
        return f" (cell{'s' * (len(cells) > 1)} {', '.join(cells)})" if 0 < len(cells) <= 2 else ""


class Kind(NamedTuple):
    """Expected kind of a file, and the command that prints one to start from."""

    name: str
    example: str


SCENE = Kind("scene", "boom_twin scene")


def read_text(path: Path, kind: Kind = SCENE) -> str:
    """Text of a scene file, or of another of its kind.

    Raises
    ------
    SceneError
        If there is no such file, or it is no UTF-8 text of at most `MAX_BYTES`.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            bound = f"more than {MAX_BYTES // 1_000_000} MB"
            raise _refusal(kind, str(path), bound, f"A {kind.name} has a few kB: is this the right file?")
        return data.decode("utf-8-sig")
    except (OSError, ValueError) as error:
        if isinstance(error, UnicodeDecodeError):
            raise _refusal(kind, str(path), *_not_utf8(data, error)) from None
        reason = getattr(error, "strerror", None) or str(error)
        remedy = f"Give the path of a {kind.name} file; `{kind.example}` prints one to start from."
        raise _refusal(kind, str(path), reason, remedy) from None


def parse(text: str, source: str, kind: Kind = SCENE) -> Document:
    """Plain values of a YAML text.

    Raises
    ------
    SceneError
        If the text is not YAML at all. What is YAML but not allowed here is in ``Document.faults``.
    """
    try:
        root, constructor = bounded_nodes(text)
    except (YAMLError, RecursionError, ValueError) as error:
        raise SceneError(source, (_syntax_fault(text, error),)) from None
    document = Document()
    if root is None:
        raise _refusal(kind, source, "the file is empty", f"Start from the one that `{kind.example}` prints.")
    document.values = _Reader(document, constructor).value(root, ())
    return document


def _not_utf8(data: bytes, error: UnicodeDecodeError) -> tuple[str, str]:
    """Return what a file is instead of UTF-8 text, and the remedy."""
    if data.startswith((b"PK", b"\xd0\xcf\x11\xe0")):  # zip, as .xlsx and .ods; .xls
        return "this is not a text file but a spreadsheet's own or an archive", "Save a spreadsheet as `CSV UTF-8`."
    if b"\0" in data:
        return "this is not a text file in UTF-8", "Give a scene or a table in YAML, or a table in CSV."
    line = data.count(b"\n", 0, error.start) + 1
    return (
        f"line {line} has a character that is not UTF-8, byte {data[error.start]:#x}",
        "Save the file with the encoding UTF-8.",
    )


def _refusal(kind: Kind, source: str, bound: str, remedy: str) -> SceneError:
    return SceneError(source, (Fault(f"{kind.name} file", source, bound, remedy),))


def _syntax_fault(text: str, error: Exception) -> Fault:
    """Return the syntax error of the YAML parser as a fault, with the line that it names."""
    line, what, rows = None, "brackets nested too deeply", text.splitlines()
    if isinstance(error, MarkedYAMLError):
        mark = error.problem_mark or error.context_mark
        what = str(error.problem or error.context)
        line = None if mark is None else min(mark.line + 1, len(rows))
    elif isinstance(error, YAMLError):
        what = str(error)
    what = " ".join(what.split())
    shown = rows[line - 1].strip() if line else text[:40].strip()
    return Fault("text", shown, f"this is not valid YAML, {what}", _yaml_remedy(what), line)


def _yaml_remedy(what: str) -> str:
    if "\\t" in what:
        return "Indent with spaces, not with tabs."
    return "Mend the text on this line or just above it: brackets, commas, colons, indentation."


class _Reader:
    """Turns nodes into values; notes lines and faults in its document."""

    def __init__(self, document: Document, constructor: Any) -> None:
        self.document = document
        self.constructor = constructor
        self.count = 0

    def value(self, node: Node, place: Place) -> Any:
        self.count += 1
        self.document.lines.setdefault(place, node.start_mark.line + 1)
        if len(place) > MAX_DEPTH or self.count > MAX_VALUES:
            if self.count <= MAX_VALUES + 1:
                bound = "nested too deeply, or too many values, for a scene"
                self._fault(place, "...", bound, "Write it without aliases that hold themselves.")
            return None
        if isinstance(node, ScalarNode):
            return self._scalar(node, place)
        if node.tag not in (TAG + "map", TAG + "seq"):
            self._refuse_tag(node, place)
        if isinstance(node, MappingNode):
            return self._mapping(node, place)
        return tuple(self.value(item, (*place, i)) for i, item in enumerate(node.value))

    def _mapping(self, node: MappingNode, place: Place) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key_node, value_node in node.value:
            key = str(key_node.value) if isinstance(key_node, ScalarNode) else "?"
            here = (*place, key)
            line = key_node.start_mark.line + 1
            if not isinstance(key_node, ScalarNode) or key_node.tag == TAG + "merge":
                self._fault(here, "...", "this kind of key is not used in scenes", "Write plain keys.")
            elif key in found:
                bound = f"the key is there twice, on line {self.document.lines[here]} and on line {line}"
                self._fault(here, found[key], bound, "Keep one of them.")
            else:
                self.document.lines[here] = line
                found[key] = self.value(value_node, here)
        return found

    def _scalar(self, node: ScalarNode, place: Place) -> Any:
        kind = str(node.tag).removeprefix(TAG)
        if kind in TYPED:
            try:
                return typed_value(self.constructor, node)
            except ValueError:
                self._fault(place, node.value, f"this is no {TYPED[kind]}", "Write the value alone, without a tag.")
                return node.value
        if kind not in ("str", "timestamp"):
            self._refuse_tag(node, place)
        elif SURROGATE.search(node.value):
            self._fault(place, node.value, "it holds half a character", "Write the text without \\uD800 to \\uDFFF.")
            return ""
        elif node.style is None and NUMBER.fullmatch(node.value):  # +.5e3, which YAML takes for text
            return float(node.value)
        return node.value

    def _refuse_tag(self, node: Node, place: Place) -> None:
        remedy = "Remove the tag: a scene holds plain values only."
        self._fault(place, node.value if isinstance(node, ScalarNode) else "...", f"the tag {node.tag} is not allowed", remedy)

    def _fault(self, place: Place, value: Any, bound: str, remedy: str) -> None:
        self.document.faults.append(self.document.fault(place, value, bound, remedy))


PROMISE = '# This file ends with the line "# end of scene"; without it, it was cut off.'
MARK = "# end of scene"


def with_end_mark(text: str) -> str:
    """The text with the mark in its last line, and in its first the promise of it, if that does not stand there already."""
    kept = [line for line in text.splitlines() if line != MARK]
    head = [] if PROMISE in kept else [PROMISE]
    return "\n".join([*head, *kept]).rstrip() + f"\n\n{MARK}\n"


def missing_end_mark(text: str) -> tuple[Fault | None, Fault | None]:
    """Return a fault if the end of a scene file is cut off, and a warning if it may be; None for either that does not apply.

    Many files that were written by hand have no mark. That is a note, and a warning where not even the last line ends.
    """
    lines = text.splitlines()
    number = max((i for i, line in enumerate(lines, 1) if line.strip()), default=0)
    last = lines[number - 1].strip() if number else ""
    if last == MARK:
        return None, None
    if PROMISE in lines and MARK not in lines:
        bound = f"the first lines say that the file ends with `{MARK}`, and it does not: it was cut off"
        remedy = "Fetch the whole file; or, if nothing is missing, add that line."
        return Fault("end of the file", last, bound, remedy, number), None
    bound = f"no line `{MARK}`, so one cannot tell whether the rest of the file was cut off"
    is_note = text.endswith("\n")
    if not is_note:
        bound = f"no line `{MARK}`, and not even an end of line: it may have been cut off"
    return None, Fault("end of the file", last, bound, "If nothing is missing, add that line at the end.", number, is_note)
