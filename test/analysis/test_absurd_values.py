"""Values that are absurd and yet allowed give numbers or one clear line; deflections out of the model's reach are told."""

from __future__ import annotations

import json
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import default_text, strokes_of_posture

from boom_twin import SolverError, UsageError, load_scene, simulate, statics

ABSURD = {
    "barrel": ("barrel: {mass: 12.0, inertia: 0.6", "barrel: {mass: 12.0, inertia: 1e+300"),
    "gravity": ("gravity: [0.0, -9.81]", "gravity: [0.0, 1e-300]"),
    "head": ("head: {mass: 12.0, com: [3.10, 0.0]", "head: {mass: 12.0, com: [1e+150, 0.0]"),
    "length": ("length: 3.10", "length: 1e+300"),
    "oil": ("k: 40.0e+6", "k: 1e+30"),
    "inertia": ("rho_I: 0.16", "rho_I: 1e+30"),
    "thin": ("I: 3.60e-5", "I: 1e-300"),
    "heavy": ("rho_A: 52.0", "rho_A: 1e+30"),
    "strong gravity": ("gravity: [0.0, -9.81]", "gravity: [0.0, -1e+6]"),
}


@pytest.mark.parametrize("name", ABSURD)
def test_absurd_values_give_numbers_or_a_refusal(tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    path, (old, new) = tmp_path / "scene.yaml", ABSURD[name]
    assert old in default_text()
    path.write_text(default_text().replace(old, new))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        code = main(["statics", str(path), "--posture", "arch", "--json"])
    out, err = capsys.readouterr()
    assert code == (0 if out else 1) and (out or err.strip())
    if out:
        assert None not in json.loads(out)["frequencies_Hz"]


def test_what_cannot_be_condensed_is_a_solver_error() -> None:
    scene = load_scene()
    heavy = scene.sections[0].model_copy(update={"rho_A": 1e300})  # past the loader, which refuses it
    with pytest.raises(SolverError), np.errstate(all="ignore"):
        statics(scene.model_copy(update={"sections": (heavy, *scene.sections[1:])}), posture="arch")


@pytest.fixture
def limp(tmp_path: Path) -> Path:
    """The default scene, its sections a hundredth as stiff."""
    path = tmp_path / "limp.yaml"
    path.write_text(re.sub(r" I: \S+,", " I: 2.0e-7,", default_text()))
    return path


def test_a_deflection_beyond_half_the_reach_is_told(limp: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["statics", str(limp), "--posture", "arch", "--json"]) == 0
    out, err = capsys.readouterr()
    (told,) = json.loads(out)["warnings"]
    assert "outside the model's validity" in told and "outside the model's validity" in err
    found = statics(load_scene(limp), posture="arch")
    assert f"{np.linalg.norm(found.tip - found.tip_rigid):.3g} m" in told
    drive = tmp_path / "drive.csv"
    rows = "\n".join(",".join([f"{t}", *map(repr, map(float, found.strokes))]) for t in (0.0, 0.01, 0.02))
    drive.write_text("t_s,stroke_1_m,stroke_2_m,stroke_3_m,stroke_4_m\n" + rows + "\n")
    assert main(["simulate", str(limp), "--posture", "arch", "--drive", str(drive), "--out", str(tmp_path / "o.csv")]) == 0
    assert "outside the model's validity" in capsys.readouterr().err


@pytest.mark.parametrize(
    "times, told",
    [
        ([0.0, 5e6, 1e7], "t_s = 1e+07 s in row 3 of the drive: 1e+10 steps of 0.001 s, 2e+07 at most. Give times in s"),
        ([0.0, 1e-9, 1.0], "t_s = 1e-09 s in row 2 of the drive: 1e-09 s after row 1, 1e-06 s at least"),
    ],
)
def test_times_that_cannot_be_stepped_are_refused(times: list[float], told: str) -> None:
    scene = load_scene()
    with pytest.raises(UsageError, match=re.escape(told)):
        simulate(scene, np.array(times), np.tile(strokes_of_posture(scene, "arch"), (3, 1)))
