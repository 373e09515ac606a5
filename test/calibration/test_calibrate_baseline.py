"""``boom_twin calibrate --baseline``: what is learnt from the bundled session, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boom_twin import load_scene
from boom_twin.cli.main import main
from boom_twin.health.baseline import load_baseline
from boom_twin.health.inference.fault_catalogue import parameters

BAG = Path(__file__).parents[2] / "bags" / "arch_session"


@pytest.fixture(scope="module")
def learnt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("learnt") / "rig.yaml"
    assert main(["calibrate", "--baseline", str(path), str(BAG), "--date", "2026-01-02"]) == 0
    return path


def test_a_right_model_is_off_by_nothing(learnt: Path) -> None:
    baseline, known = load_baseline(learnt), parameters(load_scene())
    assert baseline.description.startswith("learnt 2026-01-02") and baseline.sessions[0].startswith("arch_session ")
    mean, covariance = baseline.healthy(known)
    healthy = np.array([each.healthy > 0.0 for each in known])
    assert np.all(np.abs(mean[healthy]) < 3.0 * np.sqrt(np.diag(covariance)[healthy]))
    place = {each.name: i for i, each in enumerate(known)}
    assert np.sqrt(covariance[place["cylinder_2.k:softer"], place["cylinder_2.k:softer"]]) < 0.03  # 0.04: nothing learnt


def test_it_is_not_overwritten(learnt: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "--baseline", str(learnt), str(BAG)]) == 1
    assert "is there already. Give another name, or --force." in capsys.readouterr().err


def test_either_a_scene_or_a_baseline_is_made(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["calibrate", str(BAG)])
    assert stop.value.code == 2 and "--out --baseline" in capsys.readouterr().err
