"""Picture of journals in their bushes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boom_twin.plots.history import Orbits
from boom_twin.plots.posture import orbits_picture


def circling(pins: int, instants: int) -> Orbits:
    turn = np.linspace(0.0, 6.0, instants)
    rows = np.stack([1e-4 * np.cos(turn), 1e-4 * np.sin(turn), 1e3 + turn, (turn < 4.0).astype(float)], axis=1)
    names = tuple(f"cylinder_{i + 1}.rod" for i in range(pins))
    lost = np.ones(pins, dtype=np.int64)
    return Orbits(np.linspace(0.0, 1.0, instants), names, np.full(pins, 1e-4), np.tile(rows[:, None], (1, pins, 1)), lost)


@pytest.mark.parametrize("pins, instants", [(1, 50), (4, 50)])
def test_it_is_drawn_and_the_same_bytes_again(tmp_path: Path, pins: int, instants: int) -> None:
    written = [tmp_path / name for name in ("a.png", "b.png")]
    for path in written:
        orbits_picture(path, "journals", circling(pins, instants))
    first, second = (path.read_bytes() for path in written)
    assert first == second and first[:4] == b"\x89PNG"


def test_every_pin_of_a_boom_at_a_single_instant_is_drawn(tmp_path: Path) -> None:
    orbits_picture(tmp_path / "a.png", "journals", circling(17, 1))
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"
