"""Edits carried out on the text of a scene file: only the keys that change are touched, comments and layout stay."""

from __future__ import annotations

import io
from collections.abc import Iterable

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import CollectionNode, MappingNode, Node, SequenceNode

from ..errors import SceneError
from ..scene.parts import Scene
from ..scene.read import Place, parse
from ..scene.structure import structure
from .edits import Edit, edited, yaml_text

Pair = tuple[Node, Node]


def rewritten(text: str, scene: Scene, edits: Iterable[Edit]) -> str:
    """Text of a scene after `edits`; `scene` is what the text describes.

    Where blocks share their text (YAML aliases) an edit of one would change the other too: then the result is written anew,
    without comments.
    """
    edits = tuple(edits)
    wanted = edited(scene, edits)
    try:
        for edit in edits:
            text = _after(text, edit)
        found, _, faults = structure(parse(text, "edited scene"))
    except (YAMLError, SceneError):
        return _anew(wanted)
    same = found is not None and not faults and found.model_dump() == wanted.model_dump()
    return text if same else _anew(wanted)


def _after(text: str, edit: Edit) -> str:
    """Text after one edit."""
    block = _block(YAML(typ="safe", pure=True).compose(text), edit.place[:-1])
    pairs = block.value
    names = [str(key.value) for key, _ in pairs]
    if edit.place[-1] not in names:
        return text if edit.value is None else _inserted(text, block, f"{edit.place[-1]}: {yaml_text(edit.value)}")
    number = names.index(str(edit.place[-1]))
    if edit.value is None:
        return _removed(text, block, number)
    value = pairs[number][1]
    return text[: value.start_mark.index] + yaml_text(edit.value) + text[_end(value) :]


def _block(node: Node, place: Place) -> MappingNode:
    """The mapping at a place."""
    for step in place:
        if isinstance(node, MappingNode):
            node = next(value for key, value in node.value if key.value == step)
        else:
            assert isinstance(node, SequenceNode) and isinstance(step, int)
            node = node.value[step]
    assert isinstance(node, MappingNode)
    return node


def _inserted(text: str, block: MappingNode, line: str) -> str:
    """A key added: at the end of a block in braces, else above its first key."""
    if block.flow_style:
        end = _end(block.value[-1][1])
        return f"{text[:end]}, {line}{text[end:]}"
    mark = block.value[0][0].start_mark
    return f"{text[: mark.index]}{line}\n{' ' * mark.column}{text[mark.index :]}"


def _removed(text: str, block: MappingNode, number: int) -> str:
    """A key taken out with its value; in a block without braces, with the rest of its line."""
    pairs: list[Pair] = block.value
    start, end = pairs[number][0].start_mark.index, _end(pairs[number][1])
    if number == 0:
        return text[:start] + text[pairs[1][0].start_mark.index :]
    if block.flow_style:
        return text[: _end(pairs[number - 1][1])] + text[end:]
    line_end = text.find("\n", end)
    return text[: text.rfind("\n", 0, start) + 1] + (text[line_end + 1 :] if line_end >= 0 else "")


def _end(node: Node) -> int:
    """Where the text of a node ends; the mark of a block without braces lies behind the comments that follow it."""
    if not isinstance(node, CollectionNode) or node.flow_style or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _end(last[1] if isinstance(node, MappingNode) else last)


def _anew(scene: Scene) -> str:
    stream = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.dump(_plain(scene.model_dump(exclude_none=True)), stream)
    return stream.getvalue()


def _plain(value: object) -> object:
    """Lists for tuples."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, tuple | list) else value
