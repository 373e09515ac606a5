"""Scenes that differ from the default one by small edits, and what loading them finds."""

from __future__ import annotations

import copy
import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from default_boom import default_text, examine, example_text, with_end_mark
from ruamel.yaml import YAML

from boom_twin import SceneError
from boom_twin.errors import Fault

Values = dict[str, Any]
Edit = Callable[[Values], None]
GONE = object()
OIL = {"bore": 0.1, "rod": 0.07, "bulk_modulus": 1.5e9, "cap_line": 1e-3, "rod_line": 1e-3}
DEFAULT: Values = YAML(typ="safe", pure=True).load(default_text())


def example(name: str) -> Values:
    """Return the values of an example scene."""
    return YAML(typ="safe", pure=True).load(example_text(name))


def put(values: Any, path: str, value: Any) -> None:
    """Set (or, with GONE, remove) the value at a path such as ``sections[1].root.mass``."""
    *steps, last = (int(index) if index else key for key, index in re.findall(r"(\w+)|\[(\d+)\]", path))
    for step in steps:
        values = values[step]
    if value is GONE:
        del values[last]
    else:
        values[last] = value


class Bench:
    """Writes edited scenes and returns what loading them finds."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "scene.yaml"

    def write(self, values: Any) -> Path:
        """Write a scene file of these values."""
        stream = io.StringIO()
        YAML(typ="safe", pure=True).dump(values, stream)
        return self.text(with_end_mark(stream.getvalue()))

    def text(self, text: str) -> Path:
        """Write a scene file of this text."""
        self.path.write_text(text, encoding="utf-8")
        return self.path

    def edited(self, edit: Edit) -> Path:
        """Write the default scene after an edit."""
        values = copy.deepcopy(DEFAULT)
        edit(values)
        return self.write(values)

    def faults(self, edit: Edit) -> tuple[Fault, ...]:
        """Return the faults of the default scene after an edit; none if it loads."""
        return self.faults_of(self.edited(edit))

    def faults_of(self, path: Path) -> tuple[Fault, ...]:
        """Return the faults of a file; none if it loads."""
        try:
            examine(path)
        except SceneError as error:
            return error.faults
        return ()

    def oddities(self, edit: Edit) -> list[Fault]:
        """Return the warnings of the default scene after an edit, which must load."""
        return examine(self.edited(edit))[1]
