"""Picture of a boom, and the geometry it is drawn from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boom_twin import Scene, load_scene, statics
from boom_twin.analysis.undeflected import UndeflectedBoom
from boom_twin.compiler.compile import compile_scene
from boom_twin.plots.boom import boom_picture
from boom_twin.scene.kinematics import posture_angles, skeleton, strokes_of_posture


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene()


def shortened(scene: Scene, count: int) -> Scene:
    """The default boom with `count` sections; a fifth one is a copy of the fourth."""
    take = [min(i, 3) for i in range(count)]
    postures = {"arch": tuple(scene.postures["arch"][i] for i in take[:4]) + (-100.0,) * (count - 4)}
    joints, sections = (tuple(items[i] for i in take) for items in (scene.joints, scene.sections))
    return scene.model_copy(update={"joints": joints, "sections": sections, "postures": postures})


@pytest.mark.parametrize("name", ["horizontal", "arch", "high", "low"])
def test_pins_agree_with_lengths_and_strokes(scene: Scene, name: str) -> None:
    bones, strokes = skeleton(scene, posture_angles(scene, name)), strokes_of_posture(scene, name)
    for joint, part, stroke in zip(bones.joints, scene.joints, strokes, strict=True):
        length = np.hypot(*(joint.rod_pin - joint.barrel_pin))
        assert length == pytest.approx(part.cylinder.closed_length + stroke, abs=1e-9)
        if joint.d is not None and joint.e is not None and joint.q is not None:
            assert np.hypot(*(joint.q - joint.d)) == pytest.approx(part.lL, abs=1e-9)
            assert np.hypot(*(joint.q - joint.e)) == pytest.approx(part.lR, abs=1e-9)
            over, out = joint.e - joint.d, joint.q - joint.d
            assert over[0] * out[1] - over[1] * out[0] > 0.0, "Q is not to the left of D->E"
    sides = [part.length * np.exp(1j * np.radians(up)) for part, up in zip(scene.sections, scene.postures[name], strict=True)]
    assert complex(*bones.pivots[-1]) == pytest.approx(complex(*scene.base.pivot) + sum(sides), abs=1e-12)


def test_undeformed_outline_lies_on_the_sections(scene: Scene) -> None:
    angles = posture_angles(scene, "arch")
    line, bones = UndeflectedBoom(scene, compile_scene(scene)).at(angles), skeleton(scene, angles)
    assert line[-1] == pytest.approx(bones.pivots[-1], abs=1e-9)
    for point in line:
        away = []
        for i in range(4):
            along = bones.pivots[i + 1] - bones.pivots[i]
            share = np.clip((point - bones.pivots[i]) @ along / (along @ along), 0.0, 1.0)
            away.append(np.hypot(*(point - bones.pivots[i] - share * along)))
        assert min(away) < 1e-9


@pytest.mark.parametrize("count", [1, 4, 5])
def test_boom_is_drawn(scene: Scene, tmp_path: Path, count: int) -> None:
    from matplotlib.image import imread

    own = shortened(scene, count)
    path = boom_picture(own, statics(own, posture="arch"), tmp_path / "boom.png", note="surrogate parameters")
    image = np.asarray(imread(path)[:, :, :3], dtype=float)
    assert image.shape == (900, 1600, 3)
    assert image.std() > 0.05
    saturation = image.max(axis=2) - image.min(axis=2)
    assert (saturation > 0.3).mean() > 0.002, "nothing coloured was drawn"
