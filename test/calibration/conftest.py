"""Motions of the virtual rig for the tests of calibration; simulated once for all processes."""

from __future__ import annotations

import pytest

pytest.importorskip("exudyn")

from calibration.sessions import Made, made, off
from made_once import MadeOnce
from oracle.booms import short_boom

from boom_twin import Scene, load_scene


@pytest.fixture(scope="session")
def wrong_boom(made_once: MadeOnce) -> Made:
    """60 s of the default boom with other stiffnesses and 15 kg at the tip."""
    truth = off(load_scene(), 1.1, 0.9, 1.08, 0.92, **{"tip.payload": 15.0})
    return made_once.value("wrong_boom", lambda: made(truth, "arch", 60.0, 1))


@pytest.fixture(scope="session")
def two_sections() -> Scene:
    """Quick to simulate."""
    return short_boom(2)


@pytest.fixture(scope="session")
def short(two_sections: Scene, made_once: MadeOnce) -> Made:
    """30 s of two sections with other stiffnesses, under a pump."""
    return made_once.value("short", lambda: made(off(two_sections, 0.92, 1.1), "arch", 30.0, 4, ("pump:0.5:150",)))
