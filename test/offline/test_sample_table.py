"""The table of a replay holds what its reports hold, measured values in the rows that they are of, whatever its parts."""

from __future__ import annotations

import csv
import gzip
from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import strokes_of_posture
from drive_twin import drive_twin
from recordings import write_session

from boom_twin import Sample, Stream, load_scene
from boom_twin.offline import recording
from boom_twin.offline.recording import Recording, Stretch
from boom_twin.offline.sample_table import SampleTable, columns_of, predicted_columns, table_file
from boom_twin.twin.blocks import block_of

START, STEP = 1_700_000_000_000_000_000, 5_000_000
REFERENCE = Path(__file__).parents[1] / "data" / "reference" / "arch_move.csv.gz"


def test_the_first_columns_are_those_of_the_reference() -> None:
    with gzip.open(REFERENCE, "rt") as file:
        assert file.readline().strip().split(",") == predicted_columns(4) == columns_of(4)[:17]


def samples() -> list[Sample]:
    """12 s at 200 Hz: angles between the strokes, late, every second missing; the IMU with the stamps of the strokes."""
    chance, strokes = np.random.default_rng(2), strokes_of_posture(load_scene(), "arch")
    found: list[tuple[int, Sample]] = []
    for row in range(2400):
        stamp = START + row * STEP
        found.append((3 * row, Sample(Stream.STROKES, stamp, strokes + 1e-5 * chance.standard_normal(4))))
        found.append((3 * row + 1, Sample(Stream.IMU, stamp, np.array([0.0, 9.8]) + 0.01 * chance.standard_normal(2))))
        if row % 2:
            angles = np.where([True, True, row % 4 == 1, False], 0.1 + 1e-4 * row, np.nan)
            found.append((3 * row + 8, Sample(Stream.ANGLES, stamp - STEP // 3, angles)))
    return [sample for _, sample in sorted(found, key=lambda each: each[0])]


def table(folder: Path, stretch: int, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Recording]:
    """The table of `samples` in stretches of so many predictions, and a recording of the whole."""
    monkeypatch.setattr(recording, "STRETCH", stretch)
    path = folder / "samples.csv"
    file, found = table_file(path, columns_of(4)), Recording(4)
    made = SampleTable(file.write, 4)
    stretches: list[Stretch] = []

    def take(each: Stretch) -> None:
        stretches.append(each)
        made.add(each)

    parts, twin, given = Recording(4, take), drive_twin(load_scene()), samples()
    for first in range(0, len(given), 300):
        block = block_of(given[first : first + 300], 4)
        rows = twin.take(block)
        parts.add(rows, block)
        found.add(rows, block)
    parts.close()
    assert len(stretches) > 1 or stretch > 2400
    made.finish()
    file.close()
    return path, found


def read(path: Path) -> dict[str, np.ndarray]:
    with path.open() as file:
        rows = list(csv.reader(file))
    numbers = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows[1:]])
    return dict(zip(rows[0], numbers.T, strict=True))


def test_rows_are_what_was_predicted_measured_and_estimated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "parts").mkdir()
    path, found = table(tmp_path / "parts", 500, monkeypatch)
    whole, _ = table(tmp_path, 5000, monkeypatch)
    assert path.read_bytes() == whole.read_bytes()
    told, whole_stretch = read(path), found.whole
    predictions, estimates = whole_stretch.predictions, whole_stretch.estimates
    assert told["t_s"] == pytest.approx((predictions.stamps - predictions.stamps[0]) * 1e-9, abs=1e-9)
    assert told["tip_ay_m_s2"] == pytest.approx(predictions.tip_acceleration[:, 1], rel=1e-8, abs=1e-30)
    assert told["cylinder_force_3_N"] == pytest.approx(predictions.cylinder_forces[:, 2], rel=1e-8)
    assert told["estimate_tip_x_m"] == pytest.approx(estimates.tip[:, 0], rel=1e-8)
    assert told["estimate_load_y_N"] == pytest.approx(estimates.load[:, 1], rel=1e-8)
    assert told["estimate_sigma_tip_angle_rad"] == pytest.approx(np.sqrt(estimates.tip_covariance[:, 5]), rel=1e-8)
    assert told["estimate_tip_vy_m_s"] == pytest.approx(estimates.velocity[:, 1], rel=1e-8)
    assert told["estimate_sigma_tip_vx_m_s"] == pytest.approx(np.sqrt(estimates.velocity_covariance[:, 0]), rel=1e-8)
    for i in range(6):
        assert told[f"estimate_mode_{i + 1}_m"] == pytest.approx(estimates.modes[:, i], rel=1e-8, nan_ok=True)
        assert told[f"estimate_mode_{i + 1}_m_s"] == pytest.approx(estimates.mode_rates[:, i], rel=1e-8, nan_ok=True)
    innovations = found.whole.residuals_of(Stream.STROKES)
    assert np.isnan(told["residual_cylinder_2_m"][0]) and len(innovations.stamps) == len(predictions.stamps) - 1
    assert told["residual_cylinder_2_m"][1:] == pytest.approx(innovations.values[:, 1], rel=1e-8)
    given = samples()
    strokes = {each.stamp: each.values for each in given if each.stream is Stream.STROKES}
    assert told["measured_cylinder_2_m"] == pytest.approx(
        [strokes[stamp][1] for stamp in predictions.stamps.tolist()], rel=1e-8
    )
    angles = {each.stamp + STEP // 3: each.values for each in given if each.stream is Stream.ANGLES}
    expected = np.array([angles.get(stamp, np.full(4, np.nan)) for stamp in predictions.stamps.tolist()])
    for i in range(4):
        assert told[f"measured_joint_{i + 1}_rad"] == pytest.approx(expected[:, i], rel=1e-8, nan_ok=True)
        known = np.isfinite(told[f"residual_joint_{i + 1}_rad"])
        assert known.sum() >= 0.98 * np.isfinite(expected[:, i]).sum() and not (known & np.isnan(expected[:, i])).any()
    rows = found.whole.residuals_of(Stream.IMU)
    assert told["residual_tip_imu_z_m_s2"][np.isin(predictions.stamps, rows.stamps)] == pytest.approx(
        rows.values[:, 1], rel=1e-8
    )


@pytest.fixture
def session(tmp_path: Path) -> Path:
    still = np.tile(strokes_of_posture(load_scene(), "arch"), (400, 1))
    write_session(
        tmp_path / "session", START + np.arange(400) * STEP, still, np.zeros_like(still), None, {"origin": "synthetic"}
    )
    return tmp_path / "session"


def test_parquet_holds_the_same_numbers(session: Path, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    for kind in ("csv", "parquet"):
        assert main(["replay", str(session), "--out", str(tmp_path / kind), "--no-pictures", "--table", kind]) == 0
    found, told = parquet.read_table(tmp_path / "parquet" / "samples.parquet"), read(tmp_path / "csv" / "samples.csv")
    assert found.column_names == list(told) == columns_of(4)
    for name, column in told.items():
        values = found.column(name)
        assert values.null_count == np.isnan(column).sum()
        assert np.array([np.nan if each is None else each for each in values.to_pylist()]) == pytest.approx(
            column, rel=1e-8, nan_ok=True
        )
