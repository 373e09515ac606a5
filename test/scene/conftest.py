"""An editor of the default scene for all tests of this folder."""

from __future__ import annotations

from pathlib import Path

import pytest
from scene.editing import Bench


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    """An editor of the default scene."""
    return Bench(tmp_path)
