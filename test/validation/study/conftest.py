"""Booms that are quick to study."""

from __future__ import annotations

import pytest
from oracle import booms

from boom_twin.scene.schema import Scene


def short_boom(sections: int) -> Scene:
    """The first sections of the default boom, with postures cut to them."""
    spec = booms.document()
    spec["sections"], spec["joints"] = spec["sections"][:sections], spec["joints"][:sections]
    spec["postures"] = {name: angles[:sections] for name, angles in spec["postures"].items() if name in ("arch", "low")}
    return booms.scene_of(spec)


@pytest.fixture(scope="session")
def two_sections() -> Scene:
    return short_boom(2)
