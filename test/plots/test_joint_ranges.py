"""`check --picture`: every pin of every joint over its range."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import main

from boom_twin import load_scene
from boom_twin.plots.joint_ranges import joint_ranges_picture


def pixels(path: Path) -> np.ndarray:
    from matplotlib.image import imread

    return np.asarray(imread(path)[:, :, :3], dtype=float)


@pytest.mark.parametrize("count", [1, 4])
def test_it_is_drawn_for_any_number_of_joints(tmp_path: Path, count: int) -> None:
    scene = load_scene()
    postures = {"arch": scene.postures["arch"][:count]}
    update = {"sections": scene.sections[:count], "joints": scene.joints[:count], "postures": postures}
    image = pixels(joint_ranges_picture(tmp_path / "pins.png", scene.model_copy(update=update), "boom"))
    assert image.shape == (800 * (1 + count // 3), 900 * min(count + 1, 2) if count < 2 else 1800, 3)
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
