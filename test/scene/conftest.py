"""Scenes that differ from the default one by small edits."""

from __future__ import annotations

import copy
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from boom_twin.errors import Fault, SceneError
from boom_twin.scene.load import default_text, examine
from boom_twin.scene.yaml_reader import with_end_mark

Values = dict[str, Any]
Edit = Callable[[Values], None]

DEFAULT: Values = YAML(typ="safe", pure=True).load(default_text())


class Bench:
    """Writes edited scenes and says what loading them finds."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "scene.yaml"

    def values(self) -> Values:
        """A copy of the default scene's values."""
        return copy.deepcopy(DEFAULT)

    def write(self, values: Any) -> Path:
        """A scene file of these values."""
        stream = io.StringIO()
        YAML(typ="safe", pure=True).dump(values, stream)
        return self.text(with_end_mark(stream.getvalue()))

    def text(self, text: str) -> Path:
        """A scene file of this text."""
        self.path.write_text(text, encoding="utf-8")
        return self.path

    def edited(self, edit: Edit) -> Path:
        """The default scene after an edit."""
        values = self.values()
        edit(values)
        return self.write(values)

    def faults(self, edit: Edit) -> tuple[Fault, ...]:
        """Faults of the default scene after an edit; empty if it loads."""
        return self.faults_of(self.edited(edit))

    def faults_of(self, path: Path) -> tuple[Fault, ...]:
        """Faults of a file; empty if it loads."""
        try:
            examine(path)
        except SceneError as error:
            return error.faults
        return ()

    def oddities(self, edit: Edit) -> list[Fault]:
        """Warnings of the default scene after an edit, which must load."""
        return examine(self.edited(edit))[1]


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    """An editor of the default scene."""
    return Bench(tmp_path)
