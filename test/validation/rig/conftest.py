"""Scenes for the tests of the virtual rig."""

from __future__ import annotations

from typing import Any

import pytest
from oracle import booms


@pytest.fixture
def document() -> dict[str, Any]:
    """The default scene as plain mappings, to be changed at will."""
    return booms.document()


@pytest.fixture
def one_rigid() -> dict[str, Any]:
    """One rigid section of 40 kg on a massless, undamped cylinder with an oil spring."""
    return booms.one_rigid(k=2.0e6)


@pytest.fixture
def cantilever(document: dict[str, Any]) -> dict[str, Any]:
    """One beam of 4 m, clamped at the pivot by an incompressible cylinder."""
    section = {"length": 4.0, "beam": [0.0, 4.0], "A": 3.0e-3, "I": 1.0e-5, "rho_A": 20.0, "rod_pin": [0.0, -0.12]}
    cylinder = {"closed_length": 0.8, "max_stroke": 0.79}
    joint = {"kind": "A", "range_deg": [-30, 30], "cylinder": cylinder}
    base = {"pivot": [0.0, 0.0], "cylinder_pin": [1.2, -0.12]}
    return document | {"sections": [section], "joints": [joint], "postures": {"flat": [0]}, "base": base}
