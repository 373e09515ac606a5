"""The start of a quick move is the move of a drive, not a load that has come."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
import pytest

from boom_twin import load_scene, replay, simulate, statics


@pytest.mark.parametrize(("cylinder", "travel", "seconds"), [(4, -0.04, 1.0), (1, 0.05, 1.5), (3, 0.03, 1.0)])
def test_a_quick_start_is_no_load(cylinder, travel, seconds, tmp_path):
    scene, rng = load_scene(), np.random.default_rng(5)
    times = np.arange(0.0, 6.0, 0.005)
    share = np.clip((times - 2.5) / seconds, 0.0, 1.0)
    strokes = np.tile(statics(scene, "arch").strokes, (len(times), 1))
    strokes[:, cylinder - 1] += travel * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    boom = simulate(scene, times, strokes, estimate_errors=False)
    lengths = boom.lengths + rng.normal(0.0, 2e-5, boom.lengths.shape)
    rows = {"t_s": times} | {f"cylinder_{i + 1}": column for i, column in enumerate(lengths.T)}
    found = replay(rows, scene, tmp_path / "out", with_bag=False)
    columns = found.columns()
    tip = np.column_stack([columns["tip_x_m"], columns["tip_y_m"]])
    assert np.abs(tip - boom.tip[:, :2]).max() < 0.01
    assert not found.summary["alarms"]


def test_three_valves_that_open_at_once_are_no_load(tmp_path):
    """The last cylinder of the folded boom moves as a load at the tip would compress it; the valves of two others are open."""
    scene, rng = load_scene(files("boom_twin") / "examples" / "five_section_z_fold.yaml"), np.random.default_rng(7)
    times = np.arange(0.0, 6.0, 0.005)
    share = np.clip((times - 2.5) / 1.5, 0.0, 1.0)[:, None]
    travel = np.array([0.1, 0.0, -0.02, 0.0, -0.012])
    strokes = statics(scene, "folded").strokes + travel * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    boom = simulate(scene, times, strokes, estimate_errors=False)
    lengths = boom.lengths + rng.normal(0.0, 2e-5, boom.lengths.shape)
    rows = {"t_s": times} | {f"cylinder_{i + 1}": column for i, column in enumerate(lengths.T)}
    columns = replay(rows, scene, tmp_path / "out", with_bag=False).columns()
    tip = np.column_stack([columns["tip_x_m"], columns["tip_y_m"]])
    assert np.abs(tip - boom.tip[:, :2]).max() < 0.04
