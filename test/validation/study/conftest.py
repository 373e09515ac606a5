"""Boom that is quick to study."""

import pytest
from oracle import booms

from boom_twin import Scene


@pytest.fixture(scope="session")
def two_sections() -> Scene:
    return booms.short_boom(2)
