"""Common to tests of pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import pytest


@pytest.fixture
def figures_of(monkeypatch: pytest.MonkeyPatch) -> Callable[[ModuleType], list[Any]]:
    """Keep the figures of a module that draws pictures, laid out as they are written."""

    def keep(drawing: ModuleType) -> list[Any]:
        figures: list[Any] = []
        picture = drawing.picture

        @contextmanager
        def kept(*args: Any) -> Iterator[Any]:
            with picture(*args) as figure:
                yield figure
                figure.draw_without_rendering()
                figures.append(figure)

        monkeypatch.setattr(drawing, "picture", kept)
        return figures

    return keep
