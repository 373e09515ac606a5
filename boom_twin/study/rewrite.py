"""Edits carried out on the text of a scene file: only the keys that change are touched, comments and layout stay."""

from __future__ import annotations

import io
from collections.abc import Iterable

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from ..errors import SceneError
from ..retouch import with_value
from ..scene.end_mark import with_end_mark
from ..scene.parts import Scene
from ..scene.read import parse
from ..scene.structure import structure
from .edits import Edit, edited


def rewritten(text: str, scene: Scene, edits: Iterable[Edit]) -> str:
    """Text of a scene after `edits`; `scene` is what the text describes.

    Where blocks share their text (YAML aliases) an edit of one would change the other too: then the result is written anew,
    without comments.
    """
    edits = tuple(edits)
    wanted = edited(scene, edits)
    try:
        for edit in edits:
            text = with_value(text, edit.place, edit.value)
        found, _, faults = structure(parse(text, "edited scene"))
    except (YAMLError, SceneError):
        return anew(wanted)
    same = found is not None and not faults and found.model_dump() == wanted.model_dump()
    return text if same else anew(wanted)


def anew(scene: Scene) -> str:
    """A scene as a file without comments."""
    stream = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.dump(_plain(scene.model_dump(exclude_none=True)), stream)
    return with_end_mark(stream.getvalue())


def _plain(value: object) -> object:
    """Lists for tuples."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, tuple | list) else value
