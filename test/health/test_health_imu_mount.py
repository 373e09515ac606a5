"""An IMU that does not read gravity in its axes: told as its own fault with what is likely the matter, and not used."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from boom_twin import Sample, Stream
from boom_twin.health.blocks import BLOCK
from boom_twin.health.imu_mount import FAR, TAKEN_OUT, ImuMount
from boom_twin.types import NANO

from .recorded import Outcome, run, session
from .stream_blocks import block_of

G = 9.80665
PERIOD = BLOCK * NANO  # s
EXPECTED = np.array([-3.1, 9.3])  # m/s^2: a tip that hangs by 18 deg
TURNS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "in g": lambda f: f / G,
    "in mg": lambda f: 1000.0 * f / G,
    "with both axes the other way round": lambda f: -f,
    "with x the other way round": lambda f: f * [-1.0, 1.0],
    "with z the other way round": lambda f: f * [1.0, -1.0],
    "with x and z swapped": lambda f: f[..., ::-1],
    "with x and z swapped, both the other way round": lambda f: -f[..., ::-1],
    "turned by 90 deg anticlockwise": lambda f: np.stack([f[..., 1], -f[..., 0]], axis=-1),  # its x along the tip's z
    "turned by 90 deg clockwise": lambda f: np.stack([-f[..., 1], f[..., 0]], axis=-1),
}


def told(mount: ImuMount, read: np.ndarray, expected: np.ndarray, seconds: float = 6.0, first: int = 0) -> list[object]:
    """Every alarm that begins or ends while the IMU reads `read` with noise."""
    rng, news = np.random.default_rng(first), []
    for k in range(first, first + round(seconds / PERIOD)):
        raw = read + rng.normal(0.0, 0.5, (20, 2))
        news += mount.take(block_of(mount, raw, expected, k), k * BLOCK, (k + 1) * BLOCK)
    return news


@pytest.mark.parametrize("reason", TURNS)
def test_what_is_the_matter_is_told(reason: str) -> None:
    (alarm,) = told(ImuMount(), TURNS[reason](EXPECTED), EXPECTED)
    assert alarm.cause == "tip_imu.sensor" and alarm.until is None and alarm.since < 3e9
    assert f"as if {reason}: not used" in alarm.evidence


def test_gravity_taken_out_and_a_large_bias() -> None:
    (alarm,) = told(ImuMount(), np.zeros(2), EXPECTED)
    assert f"as if {TAKEN_OUT}:" in alarm.evidence
    (alarm,) = told(ImuMount(), EXPECTED + np.array([0.0, 4.0]), EXPECTED)
    assert "as if" not in alarm.evidence and "+13.3" in alarm.evidence


def test_a_working_imu_tells_nothing() -> None:
    """Not by noise, by a bias, nor by vibration by 10 m/s^2 that the model does not have."""
    assert told(ImuMount(), EXPECTED + 0.9 * FAR / np.sqrt(2.0), EXPECTED) == []
    mount = ImuMount()
    for k in range(200):
        times = PERIOD * (k + np.arange(20) / 20.0)
        left = np.outer(np.minimum(1.0, 0.2 * times) * np.sin(2.0 * np.pi * 0.5 * times), [6.0, -8.0])
        assert mount.take(block_of(mount, EXPECTED + left, EXPECTED, k), k, k + 1) == []
    nothing = np.full((20, 2), np.nan)
    for readings in (nothing, np.zeros((0, 2))):
        assert mount.take(block_of(mount, readings, readings, 0), 0, 1) == []


def test_an_axis_without_gravity_refutes_nothing_and_right_readings_do() -> None:
    """z the other way round reads right while the tip stands upright, and wrong again after it."""
    mount, upright = ImuMount(), np.array([-9.8, 0.1])
    told(mount, TURNS["with z the other way round"](EXPECTED), EXPECTED)
    assert told(mount, TURNS["with z the other way round"](upright), upright, 20.0, 60) == []
    (ended,) = told(mount, EXPECTED, EXPECTED, 20.0, 300)
    assert ended.until is not None and mount.alarm is None


def turned(reason: str, seconds: float) -> Outcome:
    """The bundled session with such an IMU."""
    return run(
        Sample(each.stream, each.stamp, TURNS[reason](each.values)) if each.stream is Stream.IMU else each
        for each in session(seconds)
    )


@pytest.mark.parametrize("reason", ["in g", "with x and z swapped"])
def test_a_twin_tells_it_alone_and_estimates_without_it(reason: str) -> None:
    found, right = turned(reason, 12.0), run(session(12.0))
    assert {(channel, cause) for _, channel, _, cause in found.told()} == {("tip_imu", "tip_imu.sensor")}
    tips, wanted = (np.array([r.estimate.tip for r in each.reports if r.estimate is not None])[600:] for each in (found, right))
    assert np.abs(tips - wanted).max() < 6e-3


@pytest.mark.parametrize("axis", [0, 1])
def test_an_axis_that_is_constant_is_stuck(axis: int) -> None:
    samples = session(8.0)
    held = [np.where(np.arange(2) == axis, 0.0, each.values) if each.stream is Stream.IMU else each.values for each in samples]
    found = run(Sample(each.stream, each.stamp, values) for each, values in zip(samples, held, strict=True))
    assert [(channel, kind) for _, channel, kind, _ in found.told()] == [(f"tip_imu_{'xz'[axis]}", "stuck")]
