"""Motions of the virtual rig for the tests of calibration; simulated once for all of them."""

from __future__ import annotations

import pytest

pytest.importorskip("exudyn")

from calibration.sessions import Made, cut_to, made, off

from boom_twin import load_scene
from boom_twin.scene.schema import Scene


@pytest.fixture(scope="session")
def wrong_boom() -> Made:
    """60 s of the default boom with other stiffnesses and 15 kg at the tip."""
    return made(off(load_scene(), 1.1, 0.9, 1.08, 0.92, **{"tip.payload": 15.0}), "arch", 60.0, 1)


@pytest.fixture(scope="session")
def two_sections() -> Scene:
    """Quick to simulate."""
    return cut_to(2)


@pytest.fixture(scope="session")
def short(two_sections) -> Made:
    """30 s of two sections with other stiffnesses."""
    return made(off(two_sections, 0.92, 1.1), "arch", 30.0, 4)
