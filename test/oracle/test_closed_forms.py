"""Textbook formulas: frequencies of a cantilever, and a rigid section swinging on its oil spring."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms

from boom_twin import statics

ROOTS = np.array([1.87510407, 4.69409113, 7.85475744])
LENGTH, DENSITY, GRAVITY = 3.0, 40.0, 9.81


def cantilever(modes=8, incompressible=True, **changes):
    """One section, flexible all along, clamped by a massless cylinder that stands at a right angle to its lever arm."""
    spec = booms.document()
    beam = {"length": LENGTH, "beam": [0.0, LENGTH], "A": 10.0, "I": 2.0e-5, "rho_A": DENSITY, "rod_pin": [0.0, 1.0]}
    cylinder = {"closed_length": 1.5, "max_stroke": 1.0}
    if not incompressible:
        cylinder["k"] = 5.0e5
    spec["base"] = {"pivot": [0.0, 0.0], "cylinder_pin": [-2.0, 1.0]}
    spec |= {"sections": [beam | changes], "joints": [{"kind": "A", "range_deg": [-60, 60], "cylinder": cylinder}]}
    spec |= {"modes": modes, "gravity": [0.0, -GRAVITY], "postures": {"level": [0.0]}}
    return spec


def test_oil_spring_alone():
    """A rigid rod on a spring k at a lever of 1 m; statics and frequency are those of one degree of freedom."""
    spec = cantilever(modes=0, incompressible=False) | {"gravity": [0.0, -1e-6 * GRAVITY]}
    found = statics(booms.scene_of(spec), posture="level")
    inertia, moment = DENSITY * LENGTH**3 / 3, 1e-6 * GRAVITY * DENSITY * LENGTH**2 / 2
    assert found.frequencies == pytest.approx([np.sqrt(5.0e5 / inertia) / (2 * np.pi)], rel=1e-6)
    assert found.joints == pytest.approx([-moment / 5.0e5], rel=1e-6)


def test_weight_that_hangs_stiffens_and_weight_that_stands_softens():
    """Rigid rod: stiffness k of the spring, plus m g L/2 when it hangs, minus as much when it stands."""
    spec = cantilever(modes=0, incompressible=False)
    inertia, weight = DENSITY * LENGTH**3 / 3, GRAVITY * DENSITY * LENGTH**2 / 2
    for direction, sign in ((1.0, 1.0), (-1.0, -1.0)):
        scene = booms.scene_of(spec | {"gravity": [direction * GRAVITY, 0.0]})
        found = statics(scene, posture="level").frequencies[0]
        assert found == pytest.approx(np.sqrt((5.0e5 + sign * weight) / inertia) / (2 * np.pi), rel=1e-9)


def test_rotary_inertia_lowers_frequencies_by_rayleighs_share():
    """First-order perturbation: omega_1 changes by -1/2 (rho_I/rho_A) int w'^2 / int w^2 of itself."""
    plain = statics(booms.scene_of(cantilever()), posture="level").frequencies[0]
    rotary = statics(booms.scene_of(cantilever(rho_I=0.02)), posture="level").frequencies[0]
    x = np.linspace(0.0, 1.0, 20001)
    b = ROOTS[0]
    ratio = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
    shape = np.cosh(b * x) - np.cos(b * x) - ratio * (np.sinh(b * x) - np.sin(b * x))
    slope = np.gradient(shape, x) / LENGTH
    expected = -0.5 * 0.02 / DENSITY * np.trapezoid(slope**2, x) / np.trapezoid(shape**2, x)
    assert rotary / plain - 1.0 == pytest.approx(expected, rel=2e-3)
