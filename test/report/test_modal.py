"""`boom_twin modal`: measured modes of a boom at rest in wind, against its natural frequencies."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command import main

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_modes_of_a_boom_in_wind_are_those_of_its_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("exudyn")
    pytest.importorskip("pyoma2")
    session, out = tmp_path / "session", tmp_path / "modal"
    assert (
        main(["rig", "--out", str(session), "--through", "arch", "--duration", "100", "--load", "wind:60:0.5", "--quiet"]) == 0
    )
    assert main(["statics", "--posture", "arch", "--json"]) == 0
    natural = json.loads(capsys.readouterr().out.splitlines()[-1])["frequencies_Hz"]
    assert main(["modal", str(session), "--out", str(out), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert len(found["frequency_Hz"]) >= 3
    for frequency, sigma, model in zip(found["frequency_Hz"][:3], found["frequency_sigma_Hz"], natural, strict=False):
        assert sigma < 0.02 * model and abs(frequency - model) < 3.0 * sigma + 0.01 * model
    assert all(0.0 < damping < 0.1 for damping in found["damping_ratio"])
    assert found["damping_ratio_sigma"][2] < 0.5 * found["damping_ratio"][2]  # a hundred seconds tell the first one's hardly
    (rest,) = json.loads((out / "modes.json").read_text())
    assert rest["modes"][0]["shape"].keys() >= {"tip_imu_x", "tip_imu_z", "joint_1"}
    assert (out / "rest_1.png").stat().st_size > 10_000


def test_a_session_that_rests_too_shortly_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modal", str(ROOT / "bags" / "arch_session"), "--out", str(tmp_path / "out")]) == 1
    assert "longest rest period" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
