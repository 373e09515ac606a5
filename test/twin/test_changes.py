"""What is asked of a running twin: load, limits, zeros, starts from rest; a second twin, or a replay, repeats it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from default_boom import joint_angles_of_strokes, loaded, strokes_of_posture
from drive_twin import drive_twin

from boom_twin import Report, Sample, Stream, UsageError, load_scene

RATE = 5_000_000  # ns


@pytest.fixture(scope="module")
def strokes() -> Any:
    return strokes_of_posture(load_scene(), "arch")


@pytest.fixture(scope="module")
def joints(strokes: Any) -> Any:
    return joint_angles_of_strokes(load_scene(), strokes)


def stroke(k: int, values: Any) -> Sample:
    return Sample(Stream.STROKES, k * RATE, np.array(values, dtype=float))


def angle(k: int, values: Any) -> Sample:
    return Sample(Stream.ANGLES, k * RATE, np.array(values, dtype=float))


def equal(one: Report, other: Report) -> bool:
    """To the last bit, in what is published."""
    if (one.prediction is None) != (other.prediction is None) or len(one.residuals) != len(other.residuals):
        return False
    pairs = [(a.values, b.values) for a, b in zip(one.residuals, other.residuals, strict=True)]
    if one.prediction is not None and other.prediction is not None:
        for name in ("tip_position", "tip_acceleration", "joints", "cylinder_forces"):
            pairs.append((getattr(one.prediction, name), getattr(other.prediction, name)))
    return all(a.tobytes() == b.tobytes() for a, b in pairs) and one.change == other.change


def test_a_load_starts_the_loaded_boom_from_rest(strokes: Any) -> None:
    twin = drive_twin(load_scene())
    first = twin.update(stroke(0, strokes))
    assert first.change is not None and first.change.from_rest and first.events == ()
    twin.requests.tune({"payload": 40.0, "line_fill": 10.0})
    report = twin.update(stroke(1, strokes))
    assert report.events == ("load",) and twin.counts["load"] == 1
    assert report.change is not None and report.change.from_rest
    assert (report.change.settings["payload"], report.change.settings["line_fill"]) == (40.0, 10.0)
    other = drive_twin(loaded(load_scene(), 40.0, 10.0)).update(stroke(1, strokes))
    assert report.prediction is not None and other.prediction is not None and first.prediction is not None
    assert report.prediction.tip_position.tobytes() == other.prediction.tip_position.tobytes()
    assert report.prediction.tip_position[1] < first.prediction.tip_position[1] - 0.01
    twin.requests.tune({"payload": -1.0, "line_fill": -1.0})
    back = twin.update(stroke(2, strokes))
    assert back.prediction is not None
    assert back.prediction.tip_position.tobytes() == first.prediction.tip_position.tobytes()


@pytest.mark.parametrize("live", [{"gap": 0.0}, {"payload": -2.0}, {"line_fill": np.nan}, {"imu_sigma": 2.0}, {"x": 1.0}])
def test_what_cannot_be_asked_is_refused_with_its_name(live: dict[str, float], strokes: Any) -> None:
    twin = drive_twin(load_scene())
    with pytest.raises(UsageError, match=next(iter(live))):
        twin.requests.tune(live)
    assert twin.update(stroke(0, strokes)).events == ()


def test_the_zero_of_an_angle(strokes: Any, joints: Any) -> None:
    twin, offset = drive_twin(load_scene()), np.array([0.0, 0.01, 0.0, 0.0])
    for k in range(100):
        twin.update(stroke(k, strokes))
        report = twin.update(angle(k, joints + offset))
    before = report.residuals[0].values[1]
    assert twin.rezero("joint_2") == pytest.approx({"joint_2": before})
    report = twin.update(angle(100, joints + offset))
    assert report.residuals == ()
    report = twin.update(stroke(100, strokes))
    assert report.events == ("zero",) and report.change is not None and not report.change.from_rest
    assert abs(report.residuals[-1].values[1]) < 1e-9 and abs(report.residuals[-1].values[0]) > 1e-9
    late = twin.update(angle(99, joints + offset))
    assert not late.accepted
    assert twin.rezero("joint_2") == pytest.approx({"joint_2": before})
    twin.reset()
    twin.update(stroke(101, strokes))
    twin.update(angle(101, joints + offset))
    with pytest.raises(UsageError, match=r"joint_2: 1 residuals in the last second, 5 are needed"):
        twin.rezero("joint_2")


def test_the_zero_of_a_stroke_is_the_one_that_its_angle_tells(strokes: Any) -> None:
    right, twin = drive_twin(load_scene()), drive_twin(load_scene())
    angles = right.update(stroke(0, strokes)).prediction.joints  # type: ignore[union-attr]
    offset = np.array([0.0, 0.0, 0.003, 0.0])
    for k in range(100):
        twin.update(stroke(k, strokes + offset))
        twin.update(angle(k, angles))
    found = twin.rezero("cylinder_3")["cylinder_3"]
    assert found == pytest.approx(0.003, rel=0.05)
    report = twin.update(stroke(100, strokes + offset))
    assert report.events == ("zero",) and report.change is not None and report.change.from_rest
    twin.update(angle(100, angles))
    for k in range(101, 300):
        twin.update(stroke(k, strokes + offset))
        report = twin.update(angle(k, angles))
    assert np.abs(report.residuals[0].values).max() < 1e-4


def test_a_second_twin_repeats_it_bit_for_bit(strokes: Any, joints: Any) -> None:
    """Loads, limits, zeros, starts asked for and starts by the clock, told by `Report.change` alone."""
    random, twin, other = np.random.default_rng(4), drive_twin(load_scene()), drive_twin(load_scene())
    asks = {
        40: lambda: twin.requests.tune({"payload": 35.0}),
        80: lambda: twin.rezero("joint_1"),
        120: twin.requests.rest,
        160: lambda: twin.rezero("cylinder_2"),
        200: lambda: (twin.requests.tune({"gap": 0.02, "payload": 0.0}), twin.rezero("joint_4")),
        240: twin.reset,
    }
    changes = 0
    for k in range(300):
        if k in asks:
            asks[k]()
        at = k if k < 270 else k - 260  # time is set back
        noisy = strokes + random.normal(0.0, 2e-5, 4) + 0.01 * np.sin(0.02 * k)
        samples = [stroke(at, noisy), angle(at, joints + random.normal(0.0, 1e-4, 4))]
        for sample in samples if k % 3 else reversed(samples):
            report = twin.update(sample)
            if report.change is not None:
                changes += 1
                other.requests.repeat(report.change)
            assert equal(report, other.update(sample)), k
    assert changes == 7
