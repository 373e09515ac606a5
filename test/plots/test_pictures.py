"""Pictures of a boom and of a replay: where the geometry has it, not blank, the same bytes again, densities of SciPy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import posture_angles, skeleton, strokes_of_posture
from matplotlib.image import imread
from scipy.signal import welch

from boom_twin import load_scene
from boom_twin.analysis.undeflected import UndeflectedBoom
from boom_twin.compiler.compile import compile_scene
from boom_twin.plots import History, ImuTrace, ResidualTrace, replay_pictures
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


@pytest.mark.parametrize("count", [1, 4])
def test_it_is_drawn_for_any_number_of_joints(tmp_path: Path, count: int) -> None:
    scene = load_scene()
    postures = {"arch": scene.postures["arch"][:count]}
    update = {"sections": scene.sections[:count], "joints": scene.joints[:count], "postures": postures}
    paths = [tmp_path / "pins.png", tmp_path / "again.png"]
    image, _ = (imread(joint_ranges_picture(path, scene.model_copy(update=update), "boom"))[:, :, :3] for path in paths)
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


ALL = ["tip.png", "residuals.png", "posture.png", "spectrum.png"]


def history(joints: int, seconds: float = 12.0, imu: bool = True) -> History:
    """A boom that nods at 1 Hz, with a jolt at two thirds."""
    rng = np.random.default_rng(3)
    t = np.arange(0.0, seconds, 0.005)
    swing = np.sin(2.0 * np.pi * t) * np.exp(-0.2 * np.abs(t - 0.66 * seconds))
    wave = np.stack([0.3 * swing, swing], axis=1)
    heading = 0.5 + 0.1 * swing[:, None] * np.arange(1, joints + 1)
    steps = 3.0 * np.stack([np.cos(heading), np.sin(heading)], axis=2)
    lines = np.concatenate([np.zeros((len(t), 1, 2)), np.cumsum(steps, axis=1)], axis=1)
    names = tuple(f"joint_{i + 1}" for i in range(joints)) + (("tip_imu_x", "tip_imu_z") if imu else ())
    sigmas = {name: np.full_like(t, 2e-4 if name.startswith("joint") else 0.05) for name in names}
    felt = 40.0 * wave + np.array([-9.0, 2.0])
    return History(
        stamps_s=t, tip_displacement=0.05 * wave - 0.1, tip_position=lines[:, -1], tip_acceleration=40.0 * 0.05 * wave,
        joints=heading, cylinder_forces=1e4 * heading, strokes=0.1 * heading,
        residuals={name: ResidualTrace(t, each * rng.standard_normal(len(t)), each, 0.0 * t) for name, each in sigmas.items()},
        imu=ImuTrace(t, felt + 0.05 * rng.standard_normal(felt.shape), felt) if imu else None,
        shapes=[(float(t[k]), lines[k]) for k in range(0, len(t), 50)],
    )  # fmt: skip


def assert_drawn(path: Path) -> None:
    image = imread(path)[:, :, :3]
    assert image.shape[1] == 1600 and 900 <= image.shape[0] <= 1300 and image.std() > 0.05
    dark = (image.min(axis=2) < 0.8).mean(axis=1)
    assert all(part.max() > 0.01 for part in np.array_split(dark, 4)), "a quarter of the picture is empty"


@pytest.mark.parametrize(("joints", "imu"), [(1, False), (5, True)])
def test_all_pictures_are_drawn_and_the_same_bytes_again(tmp_path: Path, joints: int, imu: bool) -> None:
    paths = replay_pictures(tmp_path / "new", history(joints, imu=imu), session="test")
    assert [path.name for path in paths] == ALL
    for path in paths:
        assert_drawn(path)
    if imu:
        again = replay_pictures(tmp_path / "again", history(joints), session="test")
        assert [path.read_bytes() for path in again] == [path.read_bytes() for path in paths]


def test_nan_and_gaps_are_survived_and_shown(tmp_path: Path) -> None:
    whole = history(2)
    t, residuals = whole.stamps_s, {}
    kept = (t < 3.0) | (t > 5.0)
    for (name, trace), step in zip(whole.residuals.items(), (2, 2, 1, len(t)), strict=True):
        residuals[name] = replace(trace, values=np.where(np.arange(len(t)) % step, trace.values, np.nan))
    felt = whole.tip_acceleration.copy()
    felt[100:120] = np.nan
    holed = replace(whole, tip_acceleration=felt, residuals=residuals)
    names = ("stamps_s", "tip_displacement", "tip_position", "tip_acceleration", "joints", "cylinder_forces", "strokes")
    holed = replace(holed, **{name: getattr(holed, name)[kept] for name in names})
    for gaps in ([], [(3.0, 5.0)]):
        paths = replay_pictures(tmp_path / f"{len(gaps)}", replace(holed, gaps=gaps), session="test")
        for path in paths:
            assert_drawn(path)
    for name in ("tip.png", "residuals.png"):
        assert (tmp_path / "0" / name).read_bytes() != (tmp_path / "1" / name).read_bytes(), "the gap is not shown"


def test_what_is_not_there_has_no_picture(tmp_path: Path) -> None:
    """Less than a spectrum needs, one sample, none, and nothing but strokes."""
    for seconds in (0.1, 0.004):
        assert [path.name for path in replay_pictures(tmp_path, history(1, seconds))] == ALL[:3]
    one = history(1, seconds=0.004)
    none = replace(one, stamps_s=np.zeros(0), tip_displacement=np.zeros((0, 2)), tip_acceleration=np.zeros((0, 2)))
    assert replay_pictures(tmp_path / "none", none) == []
    bare = replace(history(2, imu=False), residuals={}, shapes=[])
    assert [path.name for path in replay_pictures(tmp_path, bare)] == ["tip.png", "spectrum.png"]
