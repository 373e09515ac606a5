"""Rigid masses gathered about a reference point."""

from __future__ import annotations

import pytest

pytest.importorskip("exudyn")

from boom_twin.validation.rig.exudyn.masses import Lump, gather, rod


def test_two_masses_about_a_point_between_them():
    found = gather([Lump(2.0, (0.0, 0.0), 0.1), Lump(6.0, (1.0, 0.5), 0.2)], reference_x=0.5)
    assert found.mass == 8.0
    assert found.com == pytest.approx((0.25, 0.375))
    assert found.inertia == pytest.approx(0.1 + 0.2 + 2.0 * 0.25 + 6.0 * 0.5)


def test_rod_about_its_end():
    found = gather([rod(1.0, 4.0, 5.0, rotary=0.2)], reference_x=1.0)
    assert (found.mass, found.com) == (15.0, (1.5, 0.0))
    assert found.inertia == pytest.approx(15.0 * 3.0**2 / 3 + 0.2 * 3.0)


def test_nothing_has_no_mass():
    assert gather([], reference_x=1.0).mass == 0.0
