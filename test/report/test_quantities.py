"""Figures of a session and how sure they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boom_twin import BagError
from boom_twin.report.quantities import FREQUENCY_ERROR, BatchMeans, PathLength, read


def test_batch_means_are_as_sure_as_they_say() -> None:
    random, pairs = np.random.default_rng(0), np.empty((200, 2))
    for pair in pairs:
        means = BatchMeans()
        means.add(random.normal(3.0, 2.0, 500))
        pair[:] = means.mean
    assert pairs[:, 0].std() == pytest.approx(2.0 / np.sqrt(500), rel=0.2)
    assert pairs[:, 1].mean() == pytest.approx(2.0 / np.sqrt(500), rel=0.2)


def test_the_way_of_a_stroke() -> None:
    """Half a metre out, 0.2 m back, 0.1 m out; the noise of standing still is no way."""
    random = np.random.default_rng(1)
    legs_of = [(0.1, 0.1, 500), (0.1, 0.6, 500), (0.6, 0.4, 300), (0.4, 0.5, 300)]
    way = np.concatenate([np.linspace(*leg) for leg in legs_of])
    moved, still_ones = PathLength(), PathLength()
    moved.add(way + random.normal(0.0, 2e-5, len(way)))
    still_ones.add(np.full(100, 0.3) + random.normal(0.0, 2e-5, 100))
    assert moved.length == (pytest.approx(0.8, abs=3e-4), 3) and still_ones.length == (0.0, 0)


@pytest.mark.parametrize("text", [None, "{", "[]", '{"scene_sha256": "1"}', '{"scene_sha256": "1", "quantities": [{"x": 1}]}'])
def test_a_folder_without_figures(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / "quantities.json").write_text(text)
    with pytest.raises(BagError, match=r"quantities\.json: .*Replay the session again"):
        read(tmp_path)


def test_figures_of_a_replay(replays: tuple[Path, Path]) -> None:
    healthy, faulty = ({each.name: each for each in read(folder)[1]} for folder in replays)
    assert healthy.keys() == faulty.keys()
    assert abs(healthy["residual_mean_joint_3"].value) < 5e-5
    assert faulty["residual_mean_joint_3"].value == pytest.approx(0.0035 * 0.5, rel=0.05)
    ratio = healthy["frequency_ratio_mode_1"]
    assert ratio.sigma == pytest.approx(FREQUENCY_ERROR, rel=0.1) and abs(ratio.value - 1.0) < 2e-3
    assert 0.005 < healthy["damping_mode_1"].value < 0.012
    assert healthy["bending_moment_max_section_1"].value > healthy["bending_moment_max_section_4"].value > 100.0
