"""Booms with parameters drawn at random: the spread of a motion is that of its parameters, and each sample is a simulation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import parameter, strokes_of_posture, with_parameters

from boom_twin import UsageError, load_scene, simulate, statics
from boom_twin.analysis.monte_carlo import simulate_samples

SCENE = load_scene()
STROKES = strokes_of_posture(SCENE, "arch")
TIMES = np.array([0.0, 0.01, 0.02])
REST = np.tile(STROKES, (3, 1))


def test_a_sample_is_the_simulation_of_its_boom_and_a_seed_gives_the_same_ones() -> None:
    deviations = {"cylinder_2.k": 0.1, "tip.payload": 5.0}
    found = simulate_samples(SCENE, TIMES, REST, deviations, 3, seed=4)
    for i in range(3):
        boom = with_parameters(SCENE, {name: float(values[i]) for name, values in found.parameters.items()})
        alone = simulate(boom, TIMES, REST, estimate_errors=False)
        assert np.array_equal(found.motions["tip_y_m"][i], alone.tip[:, 1])
        assert np.array_equal(found.motions["cylinder_force_3_N"][i], alone.cylinder_forces[:, 2])
    again = simulate_samples(SCENE, TIMES, REST, deviations, 3, seed=4)
    assert all(np.array_equal(values, again.motions[name]) for name, values in found.motions.items())
    other = simulate_samples(SCENE, TIMES, REST, deviations, 3, seed=5)
    assert not np.array_equal(found.motions["tip_y_m"], other.motions["tip_y_m"])
    assert found.failures == () and found.doubtful == 0


def test_the_spread_at_rest_is_the_slope_times_that_of_the_parameter() -> None:
    """Of small deviations, where the boom is linear."""
    share, count = 0.01, 60
    found = simulate_samples(SCENE, TIMES[:1], REST[:1], {"cylinder_2.k": share}, count)
    stiffness = found.parameters["cylinder_2.k"]
    k = parameter(SCENE, "cylinder_2.k")
    tips = [statics(with_parameters(SCENE, {"cylinder_2.k": k * (1.0 + s)}), strokes=STROKES).tip[1] for s in (1e-3, -1e-3)]
    slope = (tips[0] - tips[1]) / (2e-3 * k)
    columns = found.columns()
    assert columns["tip_y_m_std"][0] == pytest.approx(abs(slope) * stiffness.std(ddof=1), rel=0.02)
    error = columns["tip_y_m_std"][0] / count**0.5
    assert columns["tip_y_m_mean"][0] == pytest.approx(statics(SCENE, strokes=STROKES).tip[1], abs=4.0 * error)
    low, high = columns["tip_y_m_p2.5"][0], columns["tip_y_m_p97.5"][0]
    assert high - low == pytest.approx(3.92 * columns["tip_y_m_std"][0], rel=0.3)


@pytest.mark.parametrize(
    ("deviations", "count", "told"),
    [
        ({"cylinder_9.k": 0.1}, 5, "cylinder_9.k: the scene has no such parameter"),
        ({"cylinder_1.k": 10.0}, 5, "For 10 %, give 0.1"),
        ({"cylinder_1.k": -0.1}, 5, "positive and finite"),
        ({}, 5, "vary: nothing"),
        ({"cylinder_1.k": 0.1}, 1, "a spread needs 2 at least"),
        ({"cylinder_1.k": 0.1}, 10**9, "Give fewer rows"),
    ],
)
def test_what_cannot_be_drawn_is_refused(deviations: dict[str, float], count: int, told: str) -> None:
    with pytest.raises(UsageError, match=told):
        simulate_samples(SCENE, TIMES, REST, deviations, count)


def test_samples_without_a_solution_are_left_out_and_told() -> None:
    found = simulate_samples(SCENE, TIMES[:1], REST[:1], {"tip.payload": 1e6}, 6, seed=2)
    assert len(found.failures) + len(found.parameters["tip.payload"]) == 6 and found.failures
    assert found.failures[0].startswith("tip.payload = ")
    assert len(found.motions["tip_y_m"]) == len(found.samples["tip_y_min_m"]) == 6 - len(found.failures)


def test_the_command_writes_statistics_and_samples(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drive, out = tmp_path / "drive.csv", tmp_path / "spread.csv"
    rows = "\n".join(",".join(f"{value:.9g}" for value in (t, *STROKES)) for t in TIMES)
    drive.write_text("t_s,stroke_1_m,stroke_2_m,stroke_3_m,stroke_4_m\n" + rows + "\n")
    options = ["simulate", "--drive", str(drive), "--out", str(out)]
    assert main([*options, "--samples", "4", "--vary", "cylinder_2.k=0.1"]) == 0
    header, *lines = out.read_text().splitlines()
    assert header.startswith("t_s,tip_x_m_mean,tip_x_m_std,tip_x_m_p2.5,tip_x_m_p97.5,") and len(lines) == len(TIMES)
    header, *lines = (tmp_path / "spread_samples.csv").read_text().splitlines()
    assert header.startswith("cylinder_2.k,tip_y_min_m,") and len(lines) == 4
    assert "4 samples; 2.5 %, 50 %, 97.5 % of them" in capsys.readouterr().out
