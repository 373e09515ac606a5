"""A scene's compiled model for tests that step or solve it by themselves."""

from __future__ import annotations

from boom_twin.analysis.equilibrium import rest_at, set_undeformed, settle
from boom_twin.analysis.simulate import RHO
from boom_twin.compiler.compile import compile_scene
from boom_twin.compiler.plan import Plan, first_row, taken_apart, width_of

__all__ = ["RHO", "Plan", "compile_scene", "first_row", "rest_at", "set_undeformed", "settle", "taken_apart", "width_of"]
