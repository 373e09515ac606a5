"""Sessions summed up by rig: damage and life, drift of figures, what is not known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import main
from drive_twin import ARCH_DRIVES
from health.recorded import written
from recordings import write_session
from scipy import stats
from session_readings import rows_in

from boom_twin.batch.results import rigs_of

parquet = pytest.importorskip("pyarrow.parquet")
DAY = 86_400 * 10**9
STATION = "fatigue_damage_section_1_at_0.60"


def row(number: int, rig: str = "one", hours: float = 2.0, **more: Any) -> dict[str, Any]:
    usual = {"status": "ok", "rig": rig, "file_sha256": f"{rig}{number}", "first_stamp_ns": number * DAY, "alarms": []}
    return {**usual, "duration_s": 3600.0 * hours, **more}


def worn(number: int, damage: float, other: float = 0.0, **more: Any) -> dict[str, Any]:
    damages = {STATION: damage, "fatigue_damage_section_2_at_0.10": other}
    return row(number, **damages, fatigue_category_MPa=71.0, section_heights_given=True, **more)


def test_damage_and_hours_add_up_by_rig_and_a_copy_counts_once() -> None:
    alarm = {"cause": "cylinder_2.k"}
    rows = [worn(0, 1e-5, 2e-5), worn(1, 3e-5, alarms=[alarm, alarm]), row(2, hours=5.0), worn(3, 2e-5, rig="two")]
    rows += [{**rows[0], "first_stamp_ns": 9 * DAY}, {"status": "failed", "rig": "one"}]
    one, two = rigs_of(rows)
    assert [one[key] for key in ("rig", "sessions", "repeated", "hours", "with_alarms")] == ["one", 3, 1, 9.0, 1]
    assert one["causes"] == {"cylinder_2.k": 1}
    life, station = one["fatigue"], "section_1_at_0.60"
    assert (life["damage"], life["hours"], life["sessions"]) == (pytest.approx(4e-5), 4.0, 2)
    assert life["station"] == station and life["damage_largest_share"] == pytest.approx(0.75) and life["damage_sigma"] is None
    assert life["hours_to_damage_1"] == pytest.approx(1e5) and life["hours_a_year_for_20_years"] == pytest.approx(5000.0)
    assert two["fatigue"]["station"] == station and two["hours"] == 2.0
    (idle,) = rigs_of([worn(0, 0.0)])
    assert idle["fatigue"]["hours_to_damage_1"] is None is idle["fatigue"]["hours_a_year_for_10_years"]
    (unknown,) = rigs_of([row(0)])
    assert unknown["fatigue"] is None and unknown["drifts"] == []


def test_the_scatter_of_damage_is_that_of_random_sessions() -> None:
    random = np.random.default_rng(5)
    totals, sigmas = [], []
    for _ in range(300):
        (found,) = rigs_of([worn(number, float(random.exponential(1e-5))) for number in range(30)])
        totals.append(found["fatigue"]["damage"])
        sigmas.append(found["fatigue"]["damage_sigma"])
    assert np.mean(sigmas) == pytest.approx(np.std(totals), rel=0.15)


def calibrated(values: Any, sigma: float) -> list[dict[str, Any]]:
    name = "calibrated_cylinder_1.k"
    return [row(day, **{name: value, f"{name}_sigma": sigma}) for day, value in enumerate(map(float, values))]


def test_a_drift_is_the_line_of_least_squares() -> None:
    values = 5e7 - 2e5 * np.arange(12) + 1e5 * np.random.default_rng(1).normal(size=12)
    (found,) = rigs_of(calibrated(values, 1e3))[0]["drifts"]
    line = stats.linregress(np.arange(12), values)  # the scatter is larger than the stated deviations
    assert found.change == pytest.approx(11.0 * line.slope) and found.sigma == pytest.approx(11.0 * line.stderr)
    assert found.first == pytest.approx(line.intercept) and found.days == 11.0 and found.is_significant
    (wide,) = rigs_of(calibrated(values, 1e7))[0]["drifts"]
    assert wide.sigma == pytest.approx(11.0 * 1e7 / np.sqrt(143.0)) and not wide.is_significant


def test_figures_that_only_scatter_seldom_drift() -> None:
    random = np.random.default_rng(3)
    found = [rigs_of(calibrated(random.normal(size=6), 1.0))[0]["drifts"][0].is_significant for _ in range(2000)]
    assert sum(found) <= 8, "one in a thousand"


@pytest.mark.parametrize(
    "rows",
    [
        calibrated([1.0, 2.0, 3.0], 0.1),
        calibrated([1.0] * 5, 0.0),
        [{**each, "first_stamp_ns": 0} for each in calibrated(range(5), 0.1)],
    ],
)
def test_a_drift_that_cannot_be_known_is_not_told(rows: list[dict[str, Any]]) -> None:
    assert rigs_of(rows)[0]["drifts"] == []


def named(folder: Path, name: str, rig: str, seconds: float) -> None:
    """A part of the bundled session, as of a rig with a name."""
    stamps, strokes, joints, _ = rows_in(ARCH_DRIVES, seconds)
    write_session(folder / name, stamps, strokes, joints, None, {"origin": "synthetic", "rig": rig})


def test_a_batch_sums_up_the_damage_of_its_rows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("rainflow")
    named(tmp_path, "monday", "rig <7>", 12.0)
    named(tmp_path, "tuesday", "rig <7>", 9.0)
    written(tmp_path / "nameless", 3.0)
    out, bags = tmp_path / "out", [str(tmp_path / name) for name in ("monday", "tuesday", "nameless")]
    assert main(["batch", *bags, "--out", str(out), "--fatigue", "20", "--workers", "2"]) == 0
    assert "rigs.json" in capsys.readouterr().out
    rows = {each["session"]: each for each in parquet.read_table(out / "sessions.parquet").to_pylist()}
    rigs = {each["rig"]: each for each in json.loads((out / "rigs.json").read_text())["rigs"]}
    assert len(rigs) == 2 and any("scene" in name for name in rigs)
    life, own = rigs["rig <7>"]["fatigue"], [rows["monday"], rows["tuesday"]]
    damages = [each[f"fatigue_damage_{life['station']}"] for each in own]
    assert min(damages) > 0.0 and life["damage"] == pytest.approx(sum(damages))
    assert life["damage"] == max(life["damage_by_station"].values()) and life["detail_category_MPa"] == 20.0
    assert rigs["rig <7>"]["hours"] == pytest.approx(sum(each["duration_s"] for each in own) / 3600.0)
    assert life["hours_a_year_for_20_years"] == pytest.approx(rigs["rig <7>"]["hours"] / life["damage"] / 20.0)
    assert "rig &lt;7&gt;" in (out / "batch.html").read_text() and rigs["rig <7>"]["drifts"] == []
