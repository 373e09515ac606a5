"""Rainflow counts and damage against closed forms, and the report's part on fatigue."""

from __future__ import annotations

import numpy as np
import pytest
import rainflow
from command import main

from boom_twin.report.fatigue import RainflowCounter, damage_of, endured

MPA = 1e6
ASTM = np.array([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0])
ASTM_COUNTS = {3.0: 0.5, 4.0: 1.5, 6.0: 0.5, 8.0: 1.0, 9.0: 0.5}  # ASTM E1049-85, section 5.4.4


def counted(parts):
    """Counts by range in MPa of stresses that come in parts, in MPa."""
    counter, found = RainflowCounter(), {}
    for part in parts:
        counter.add(MPA * np.asarray(part))
    for size, count in counter.cycles():
        key = round(size / MPA, 6)
        found[key] = found.get(key, 0.0) + count
    return found


def test_the_standards_example():
    assert counted([ASTM]) == ASTM_COUNTS == dict(rainflow.count_cycles(ASTM))


@pytest.mark.parametrize("length", [1, 3, 7, 100])
def test_parts_of_a_session_count_like_the_whole(length):
    """The package itself counts the whole."""
    series = np.cumsum(np.random.default_rng(3).normal(size=2000))
    whole: dict[float, float] = {}
    for size, count in rainflow.count_cycles(series):
        if (key := round(size, 2)) > 0.1:
            whole[key] = whole.get(key, 0.0) + count
    parts = [series[k : k + length] for k in range(0, len(series), length)]
    assert counted(parts) == pytest.approx(whole)


def test_a_stress_that_begins_and_ends_at_its_extremes_is_half_a_cycle():
    """A move that is still going on at the end of the session: the largest range of all."""
    assert counted([[0.0, 130.0]]) == {130.0: 0.5} and counted([[0.0], [130.0], []]) == {130.0: 0.5}
    ramp = [0.0, 40.0, 35.0, 80.0, 75.0, 130.0]
    assert counted([ramp]) == {5.0: 2.0, 130.0: 0.5} == dict(rainflow.count_cycles(np.array(ramp)))
    assert counted([ramp[:3], ramp[3:]]) == counted([ramp])


def test_a_sine_does_the_damage_of_its_cycles():
    """100 periods of amplitude A: as many cycles of range 2 A, by the S-N curve's three branches."""
    for amplitude, category, expected in (
        (60.0, 71.0, 100.0 / (2e6 * (71.0 / 120.0) ** 3)),
        (20.0, 71.0, 100.0 / (5e6 * (71.0 * 0.4 ** (1 / 3) / 40.0) ** 5)),
        (10.0, 71.0, 0.0),
    ):
        counter = RainflowCounter()
        counter.add(MPA * amplitude * np.sin(np.linspace(0.0, 200.0 * np.pi, 100 * 64 + 1)))
        assert damage_of(counter.cycles(), category) == pytest.approx(expected, rel=0.011)
    assert endured(np.array([71.0 * MPA]), 71.0)[0] == pytest.approx(2e6)
    knee = 71.0 * MPA * 0.4 ** (1 / 3)
    assert endured(np.array([knee * (1 + 1e-9), knee * (1 - 1e-9)]), 71.0) == pytest.approx(5e6, rel=1e-6)


def test_the_report_has_the_fatigue_of_all_stations(replays, tmp_path, capsys):
    text = (replays[0] / "report.html").read_text(encoding="utf-8")
    assert "detail category 80 MPa" in text and "hours of such work to a damage of 1" in text and "±" in text
    assert text.partition("<h3>Fatigue")[2].count("section 1 at") == 6
    assert main(["replay", "bags/pump_session", "--out", str(tmp_path / "b"), "--fatigue"]) == 1
    assert "Give --report too" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        main(["replay", "bags/pump_session", "--out", str(tmp_path / "b"), "--report", "--no-pictures"])
