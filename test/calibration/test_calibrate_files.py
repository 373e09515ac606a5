"""What the command writes and tells."""

from __future__ import annotations

import json

import numpy as np
import pytest
from command import main
from default_boom import parameter
from recordings import load_mapping

from boom_twin import load_scene
from boom_twin.calibration import run

TEXT = """# my boom
description: "a test boom"
{body}
"""


@pytest.fixture(scope="module")
def source(two_sections, tmp_path_factory):
    """The boom of two sections as a file with comments: the default one's text, cut."""
    from default_boom import default_text

    text = default_text()
    for start, end in (("  - {length: 3.20", "# Joint i turns"), ("  - {kind: B2", "# Boom angles")):
        text = text[: text.index(start)] + "\n" + text[text.index(end) :]
    for name, angles in (("horizontal", "0, 0"), ("arch", "60, 20"), ("high", "80, 60"), ("low", "45, 0")):
        line = next(line for line in text.splitlines() if line.startswith(f"  {name}:"))
        text = text.replace(line, f"  {name}: [{angles}]  # my {name}")
    path = tmp_path_factory.mktemp("scene") / "boom.yaml"
    path.write_text(TEXT.format(body=text))
    return path


@pytest.fixture(scope="module")
def ran(source, short, tmp_path_factory):
    """The command's files, its arguments, and the calibration that it wrote."""
    folder, found = tmp_path_factory.mktemp("run"), []
    bag = short.write(folder / "bag", 2, zeros=np.array([2e-3, 0.0]))
    arguments = ["calibrate", str(bag), "--scene", str(source), "--date", "2026-01-02", "--zeros", "angles"]
    calibrate = run.calibrate
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "calibrate", lambda *given: found.append(calibrate(*given)) or found[0])
        assert main([*arguments, "--out", str(folder / "new.yaml")]) == 0
    return folder, arguments, found[0]


def test_a_result_that_does_worse_on_what_was_held_out_is_written_and_refused(source, short, tmp_path, capsys):
    """Joint 1 reads 0.01 rad too much in the part that is fitted, and as much too little in the last third."""
    wrong = np.where(np.arange(30 * 200)[:, None] < 20 * 200, 0.01, -0.01) * [1.0, 0.0]
    bag, out = short.write(tmp_path / "bag", 2, zeros=wrong), tmp_path / "new.yaml"
    options = ["--scene", str(source), "--parameters", "joint_1.zero"]
    assert main(["calibrate", str(bag), *options, "--out", str(out)]) == 1
    assert "residuals of joint_1 have grown: do not use this result" in capsys.readouterr().err and out.is_file()


def test_the_new_scene_keeps_comments_and_tells_where_it_is_from(ran, source, short):
    folder, *_ = ran
    old, new = source.read_text(), (folder / "new.yaml").read_text()
    scene = load_scene(folder / "new.yaml")
    assert parameter(scene, "cylinder_1.k") == pytest.approx(parameter(short.truth, "cylinder_1.k"), rel=0.03)
    assert scene.description.startswith("a test boom\nCalibrated 2026-01-02 by boom_twin 0.")
    before = "Before: cylinder_1.k 4e+07 N/m, cylinder_2.k 3e+07 N/m."
    for part in ("from bag (sha256 ", "held out: the last third of bag", before):
        assert part in scene.description
    comments = [{line.partition("#")[2] for line in text.splitlines() if "#" in line} for text in (old, new)]
    assert len(comments[0]) > 3 and comments[0] <= comments[1]


def test_zeros_go_into_a_mapping_that_a_replay_takes(ran, source):
    folder, *_ = ran
    sensors = load_mapping(folder / "new.mapping.yaml", 2).sensors
    assert sensors["joint_1"].zero == pytest.approx(2e-3, abs=2e-4)
    assert "cylinder_1" not in sensors
    arguments = ["replay", str(folder / "bag"), "--scene", str(folder / "new.yaml"), "--out", str(folder / "replay")]
    assert main([*arguments, "--mapping", str(folder / "new.mapping.yaml")]) == 0
    summary = json.loads((folder / "replay" / "summary.json").read_text())
    assert np.abs(summary["joint_residual_normalised_mean"]).max() < 0.3


def test_it_overwrites_only_when_told(ran, source, capsys):
    folder, arguments, _ = ran
    assert main([*arguments, "--out", str(folder / "new.yaml")]) == 1
    assert "is there already. Name another file, or give --force" in capsys.readouterr().err
    assert main([*arguments, "--out", str(source), "--force"]) == 1
    assert "this file is read. Name another one" in capsys.readouterr().err


def test_no_scene_is_written_without_its_zeros(ran, capsys, tmp_path, monkeypatch):
    """The calibration is that of before, here and in the next three: what is tested is its writing."""
    _, arguments, calibrated = ran
    monkeypatch.setattr(run, "calibrate", lambda *given: calibrated)
    (tmp_path / "new.mapping.yaml").mkdir()
    assert main([*arguments, "--out", str(tmp_path / "new.yaml"), "--force"]) == 1
    assert "new.mapping.yaml: cannot be written" in capsys.readouterr().err
    assert not (tmp_path / "new.yaml").exists()


def test_scene_and_mapping_go_into_a_new_folder(ran, tmp_path, monkeypatch):
    _, arguments, calibrated = ran
    monkeypatch.setattr(run, "calibrate", lambda *given: calibrated)
    assert main([*arguments, "--out", str(tmp_path / "a" / "b" / "new.yaml")]) == 0
    assert {path.name for path in (tmp_path / "a" / "b").iterdir()} == {"new.yaml", "new.mapping.yaml"}


def test_a_file_that_comes_while_it_works_is_kept(ran, capsys, tmp_path, monkeypatch):
    _, arguments, calibrated = ran

    def calibrate_meanwhile(*given):
        (tmp_path / "new.yaml").write_text("mine")
        return calibrated

    monkeypatch.setattr(run, "calibrate", calibrate_meanwhile)
    assert main([*arguments, "--out", str(tmp_path / "new.yaml")]) == 1
    assert "is there already. Name another file" in capsys.readouterr().err
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("new.yaml", "mine")]


def test_json_is_one_flat_object_and_goes_on_from_a_mapping(ran, capsys, tmp_path):
    _, arguments, _ = ran
    (tmp_path / "own.yaml").write_text("sensors:\n  joint_1: {zero: 0.1, unit: deg, scale: 57.29577951308232}  # mine\n")
    out = tmp_path / "again.yaml"
    arguments = [*arguments, "--mapping", str(tmp_path / "own.yaml"), "--out", str(out), "--json"]
    assert main(arguments) == 0
    told = json.loads(capsys.readouterr().out)
    assert not any(isinstance(value, dict) for value in told.values())
    assert told["cylinder_2.k_low"] < told["cylinder_2.k"] < told["cylinder_2.k_high"]
    assert told["held_out_after_joint_1"] == pytest.approx(1.0, abs=0.2) and all("tip_imu" in text for text in told["not_told"])
    assert told["files"] == [str(out), str(out.with_suffix(".mapping.yaml"))]
    text = out.with_suffix(".mapping.yaml").read_text()
    assert "# mine" in text and "unit: deg" in text
    assert load_mapping(out.with_suffix(".mapping.yaml"), 2).sensors["joint_1"].zero == pytest.approx(2e-3, abs=2e-4)
