"""``boom_twin calibrate --baseline``: what is learnt from the bundled session, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from drive_twin import ARCH_DRIVES, PUMP_DRIVES

from boom_twin import load_scene
from boom_twin.calibration.baseline import baseline_of
from boom_twin.cli.main import main
from boom_twin.health.baseline import load_baseline
from boom_twin.health.inference.fault_catalogue import parameters
from boom_twin.health.learning import BOUNDS


@pytest.fixture(scope="module")
def learnt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("learnt") / "rig.yaml"
    assert main(["calibrate", "--baseline", str(path), str(ARCH_DRIVES), "--date", "2026-01-02"]) == 0
    return path


def test_a_right_model_is_off_by_nothing(learnt: Path) -> None:
    baseline, known = load_baseline(learnt), parameters(load_scene())
    assert baseline.description.startswith("learnt 2026-01-02") and baseline.sessions[0].startswith("arch_session ")
    mean, covariance = baseline.healthy(known)
    healthy = np.array([each.healthy > 0.0 for each in known])
    assert np.all(np.abs(mean[healthy]) < 3.0 * np.sqrt(np.diag(covariance)[healthy]))
    place = {each.name: i for i, each in enumerate(known)}
    assert np.sqrt(covariance[place["cylinder_2.k:softer"], place["cylinder_2.k:softer"]]) < 0.03  # 0.04: nothing learnt


@pytest.mark.slow
def test_a_load_is_not_taken_for_errors_of_the_model() -> None:
    """Pump and wind of the bundled session, taken twice to be long enough; without their level the error is 1.3 mrad."""
    learnt = baseline_of([PUMP_DRIVES] * 2, load_scene())
    assert learnt.angle_error < 0.5 * BOUNDS["angle_error"][1]


def test_it_is_not_overwritten(learnt: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "--baseline", str(learnt), str(ARCH_DRIVES)]) == 1
    assert "is there already. Give another name, or --force." in capsys.readouterr().err


def test_either_a_scene_or_a_baseline_is_made(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["calibrate", str(ARCH_DRIVES)])
    assert stop.value.code == 2 and "--out --baseline" in capsys.readouterr().err
