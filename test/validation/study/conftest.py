"""Boom that is quick to study."""

from __future__ import annotations

import pytest
from oracle import booms

from boom_twin import Scene


@pytest.fixture(scope="session")
def two_sections() -> Scene:
    return booms.short_boom(2)
