"""Pictures of a boom, its envelope, alarms and journals: what is drawn, and the geometry it is drawn from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from default_boom import posture_angles, skeleton, strokes_of_posture

from boom_twin import load_scene
from boom_twin.analysis.undeflected import UndeflectedBoom
from boom_twin.compiler.compile import compile_scene
from boom_twin.plots.history import Orbits
from boom_twin.plots.posture import orbits_picture

SCENE, ROWS = load_scene(), 40


@pytest.mark.parametrize("name", ["horizontal", "arch", "high", "low"])
def test_pins_agree_with_lengths_and_strokes(name: str) -> None:
    bones, strokes = skeleton(SCENE, posture_angles(SCENE, name)), strokes_of_posture(SCENE, name)
    for joint, part, stroke in zip(bones.joints, SCENE.joints, strokes, strict=True):
        length = np.hypot(*(joint.rod_pin - joint.barrel_pin))
        assert length == pytest.approx(part.cylinder.closed_length + stroke, abs=1e-9)
        if joint.d is not None and joint.e is not None and joint.q is not None:
            assert np.hypot(*(joint.q - joint.d)) == pytest.approx(part.lL, abs=1e-9)
            assert np.hypot(*(joint.q - joint.e)) == pytest.approx(part.lR, abs=1e-9)
            over, out = joint.e - joint.d, joint.q - joint.d
            assert over[0] * out[1] - over[1] * out[0] > 0.0, "Q is not to the left of D->E"
    sides = [part.length * np.exp(1j * np.radians(up)) for part, up in zip(SCENE.sections, SCENE.postures[name], strict=True)]
    assert complex(*bones.pivots[-1]) == pytest.approx(complex(*SCENE.base.pivot) + sum(sides), abs=1e-12)


def test_undeformed_outline_lies_on_the_sections() -> None:
    angles = posture_angles(SCENE, "arch")
    line, bones = UndeflectedBoom(SCENE, compile_scene(SCENE)).at(angles), skeleton(SCENE, angles)
    assert line[-1] == pytest.approx(bones.pivots[-1], abs=1e-9)
    along = np.diff(bones.pivots, axis=0)
    for point in line:
        shares = np.clip(np.sum((point - bones.pivots[:-1]) * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)
        assert np.hypot(*(point - bones.pivots[:-1] - shares[:, None] * along).T).min() < 1e-9


@pytest.mark.parametrize("pins, instants", [(1, 50), (17, 1)])
def test_journals_of_every_pin_are_drawn_and_the_same_bytes_again(tmp_path: Path, pins: int, instants: int) -> None:
    turn = np.linspace(0.0, 6.0, instants)
    rows = np.stack([1e-4 * np.cos(turn), 1e-4 * np.sin(turn), 1e3 + turn, (turn < 4.0).astype(float)], axis=1)
    names, gaps, lost = tuple(f"cylinder_{i + 1}.rod" for i in range(pins)), np.full(pins, 1e-4), np.ones(pins, np.int64)
    orbits = Orbits(np.linspace(0.0, 1.0, instants), names, gaps, np.tile(rows[:, None], (1, pins, 1)), lost)
    for name in ("a.png", "b.png"):
        orbits_picture(tmp_path / name, "journals", orbits)
    first, second = ((tmp_path / name).read_bytes() for name in ("a.png", "b.png"))
    assert first == second and first[:4] == b"\x89PNG"
