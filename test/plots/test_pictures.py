"""Pictures: pins and outlines where the geometry has them, the same bytes again, densities of SciPy, extreme rows kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import posture_angles, skeleton, strokes_of_posture
from scipy.signal import welch

from boom_twin import load_scene
from boom_twin.analysis.undeflected import UndeflectedBoom
from boom_twin.compiler.compile import compile_scene
from boom_twin.plots.boom import joint_ranges_picture
from boom_twin.plots.residuals import SEGMENT, density

SCENE, ROWS = load_scene(), 40


@pytest.mark.parametrize("name", ["horizontal", "arch", "high", "low"])
def test_pins_agree_with_lengths_and_strokes(name: str) -> None:
    bones, strokes = skeleton(SCENE, posture_angles(SCENE, name)), strokes_of_posture(SCENE, name)
    for joint, part, stroke in zip(bones.joints, SCENE.joints, strokes, strict=True):
        length = np.hypot(*(joint.rod_pin - joint.barrel_pin))
        assert length == pytest.approx(part.cylinder.closed_length + stroke, abs=1e-9)
        if joint.kind != "A":
            d, e, q = (joint.named[name] for name in "DEQ")
            assert np.hypot(*(q - d)) == pytest.approx(part.lL, abs=1e-9)
            assert np.hypot(*(q - e)) == pytest.approx(part.lR, abs=1e-9)
            over, out = e - d, q - d
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


@pytest.mark.parametrize("count", [20, 101, 3000, 7001])
def test_density_is_that_of_scipy(count: int) -> None:
    times = np.arange(count) * 0.005
    values = np.random.default_rng(count).normal(3.0, 1.0, count)
    even = np.arange(times[0], times[-1], 0.005)
    frequencies, power = welch(np.interp(even, times, values), 200.0, nperseg=min(len(even), round(SEGMENT / 0.005)))
    found = density(times, values, 0.005)
    np.testing.assert_allclose(found.frequencies, frequencies[1:])
    np.testing.assert_allclose(found.power, power[1:], rtol=1e-12)


def pixels(path: Path) -> np.ndarray:
    from matplotlib.image import imread

    return np.asarray(imread(path)[:, :, :3], dtype=float)


@pytest.mark.parametrize("count", [1, 4])
def test_it_is_drawn_for_any_number_of_joints(tmp_path: Path, count: int) -> None:
    scene = load_scene()
    postures = {"arch": scene.postures["arch"][:count]}
    update = {"sections": scene.sections[:count], "joints": scene.joints[:count], "postures": postures}
    paths = [tmp_path / "pins.png", tmp_path / "again.png"]
    image, _ = (pixels(joint_ranges_picture(path, scene.model_copy(update=update), "boom")) for path in paths)
    assert image.shape == {1: (800, 1200, 3), 4: (1600, 1800, 3)}[count] and paths[0].read_bytes() == paths[1].read_bytes()
    assert ((image.max(axis=2) - image.min(axis=2)) > 0.3).mean() > 0.005, "nothing coloured was drawn"


def test_the_command_writes_it_and_nothing_over_the_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, scene = tmp_path / "pins.png", tmp_path / "boom.yaml"
    main(["scene"])
    scene.write_text(capsys.readouterr().out, encoding="utf-8")
    assert main(["check", str(scene), "--picture", str(path)]) == 0
    assert f"Written: {path}" in capsys.readouterr().out and path.read_bytes().startswith(b"\x89PNG")
    assert main(["check", str(scene), "--picture", str(path)]) == 0
    assert main(["check", "--picture", str(scene)]) == 1
    assert "is no earlier result" in capsys.readouterr().err
    assert main(["check", str(scene), "--picture", str(scene)]) == 1
