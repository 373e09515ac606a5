"""Frequencies and damping of rests and of a boom in wind."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command import answer, main
from default_boom import strokes_of_posture, with_parameters

from boom_twin import Twin, load_scene, simulate, statics
from boom_twin.offline.history import HistoryBuilder, course
from boom_twin.offline.recording import Recording
from boom_twin.report.vibration import SHORTEST_REST, RestFinder, still, vibrations
from boom_twin.twin.blocks import CODES, SampleBlock
from boom_twin.types import SECOND, Array, StrokeReading

TIMES = np.arange(0.0, 5.0, 0.005)


def swing(frequency: float, damping: float, size: float, phase: float = 0.3) -> Array:
    rate = 2.0 * np.pi * frequency
    return size * np.exp(-damping * rate * TIMES) * np.cos(rate * np.sqrt(1.0 - damping**2) * TIMES + phase)


def measured(seed: int) -> Array:
    random = np.random.default_rng(seed)
    first, second = swing(1.05, 0.008, 1.0), swing(2.4, 0.02, 0.3, 1.0)
    return np.stack([0.4 * first + second, first - 0.5 * second], axis=1) + random.normal(9.0, 0.05, (len(TIMES), 2))


def test_missing_values_are_bridged_and_what_tells_nothing_gives_nothing() -> None:
    values = measured(2)
    values[::7, 0] = np.nan
    assert min(abs(each.frequency - 1.05) for each in vibrations(TIMES, values)) < 0.01
    assert vibrations(TIMES, np.zeros((len(TIMES), 2))) == []
    for rows in (0, 1, 100):
        assert vibrations(TIMES[:rows], values[:rows]) == []


@pytest.mark.parametrize("load, payload, is_shaken", [(5.0, 0.0, False), (60.0, 0.0, True), (60.0, 3000.0, False)])
def test_where_a_load_shakes_the_boom_no_frequency_is_told(load: float, payload: float, is_shaken: bool) -> None:
    """The same decaying swing: under a pump it may be a line of that. A boom of five times the weight takes more."""
    scene = with_parameters(load_scene(), {"tip.payload": payload})
    imu = SimpleNamespace(stamps_s=TIMES, measured=measured(3))
    strokes = np.tile(strokes_of_posture(scene, "arch"), (len(TIMES), 1))
    history = SimpleNamespace(stamps_s=TIMES, strokes=strokes, imu=imu)
    forces = load * np.sin(2.7 * TIMES)[:, None] * np.array([0.0, 1.0])
    (rest,) = RestFinder(scene).find(history, forces)  # type: ignore[arg-type]
    assert rest.is_shaken == is_shaken and (0 in rest.measured) == (not is_shaken and not payload)


@pytest.fixture(scope="module")
def swung():
    """Boom that a fast move of cylinder 1 leaves swinging: lengths swing with the force in the oil, drives rest."""
    times, drives = np.arange(0.0, 4.5, 0.005), np.tile(strokes_of_posture(load_scene(), "arch"), (900, 1))
    drives[:, 0] += 0.008 * np.clip(times / 0.4, 0.0, 1.0)
    return simulate(load_scene(), times, drives, dt=5e-3, estimate_errors=False)


@pytest.mark.parametrize("reads", [StrokeReading.LENGTH, StrokeReading.DRIVE])
def test_a_boom_on_locked_drives_rests_with_the_frequencies_of_its_drives(swung, reads: StrokeReading) -> None:
    """Whatever drives the model; lengths that are taken for drives never rest, and give other frequencies."""
    scene, found = load_scene(), []
    twin, recording = Twin(scene, reads=reads), Recording(4, found.append, reads=reads)
    rows = {StrokeReading.LENGTH: swung.lengths, StrokeReading.DRIVE: swung.strokes, StrokeReading.ANGLE: swung.joints}[reads]
    times = (SECOND + np.round(SECOND * swung.times)).astype(np.int64)
    block = SampleBlock(np.full(len(times), CODES[reads.stream]), times, rows)
    recording.add(twin.take(block), block)
    recording.close()
    (stretch,) = found
    (rest,) = RestFinder(scene).find(own := HistoryBuilder(scene).add(stretch), stretch.estimates.load)
    assert rest.start < 1.0 and rest.stop > 4.3
    calm = [stop - start for start, stop in still(own.stamps_s, stretch.predictions.strokes)]
    assert reads is StrokeReading.DRIVE or max(calm, default=0.0) < SHORTEST_REST
    expected = statics(scene, swung.strokes[-1]).frequencies
    assert rest.model == pytest.approx(expected, rel=5e-4)
    resting = replace(own, stamps_s=own.stamps_s[400:], strokes=own.strokes[400:])
    assert course(resting, scene, 60)[1] == pytest.approx(np.tile(expected, (60, 1)), rel=1e-3)
    assert statics(scene, statics(scene, swung.strokes[-1]).lengths).frequencies != pytest.approx(expected, rel=3e-3)


ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_modes_of_a_boom_in_wind_are_those_of_its_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("exudyn")
    pytest.importorskip("pyoma2")
    session, out = tmp_path / "session", tmp_path / "modal"
    assert (
        main(["rig", "--out", str(session), "--through", "arch", "--duration", "100", "--load", "wind:60:0.5", "--quiet"]) == 0
    )
    natural = answer(capsys, "statics", "--posture", "arch")["frequencies_Hz"]
    found = answer(capsys, "modal", str(session), "--out", str(out))
    assert len(found["frequency_Hz"]) >= 3
    for frequency, sigma, model in zip(found["frequency_Hz"][:3], found["frequency_sigma_Hz"], natural, strict=False):
        assert sigma < 0.02 * model and abs(frequency - model) < 3.0 * sigma + 0.01 * model
    assert all(0.0 < damping < 0.1 for damping in found["damping_ratio"])
    assert found["damping_ratio_sigma"][2] < 0.5 * found["damping_ratio"][2]  # a hundred seconds tell the first one's hardly
    (rest,) = json.loads((out / "modes.json").read_text())
    assert rest["modes"][0]["shape"].keys() >= {"tip_imu_x", "tip_imu_z", "joint_1"}
    assert (out / "rest_1.png").stat().st_size > 10_000


def test_a_session_that_rests_too_shortly_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for part in ([], ["--duration", "2"]):
        assert main(["modal", str(ROOT / "bags" / "arch_session"), "--out", str(tmp_path / "out"), *part]) == 1
        assert "longest rest period" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
