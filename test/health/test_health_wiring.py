"""Sensors wired otherwise than declared: reported once, left out of the estimate, reported ended by a right start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from boom_twin import Sample, Stream, Twin, load_scene
from boom_twin.types import Channel, Place

from .recorded import Outcome, run, session

G = 9.80665
SWAP_23 = [0, 2, 1, 3]
CASES: dict[str, tuple[Stream, Callable[[np.ndarray], np.ndarray], set[str], str]] = {
    "encoders swapped": (Stream.ANGLES, lambda v: v[SWAP_23], {"joint_2", "joint_3"}, "joint_3, rad"),
    "encoders in degrees": (Stream.ANGLES, np.degrees, {"joint_1", "joint_2", "joint_3", "joint_4"}, "deg"),
    "an encoder of the other sign": (Stream.ANGLES, lambda v: v * [1, 1, -1, 1], {"joint_3"}, "sign -1"),
    "strokes swapped": (Stream.STROKES, lambda v: v[SWAP_23], {"cylinder_2", "cylinder_3"}, "cylinder_3, m"),
    "IMU in g": (Stream.IMU, lambda v: v / G, {"tip_imu"}, "g"),
    "IMU with swapped axes": (Stream.IMU, lambda v: v[::-1], {"tip_imu"}, "tip_imu_z, m/s^2"),
    "IMU without gravity": (Stream.IMU, lambda v: 0.01 * v, {"tip_imu"}, "gravity taken out"),
}


def rewired(stream: Stream, change: Callable[[np.ndarray], np.ndarray], seconds: float) -> list[Sample]:
    """The bundled session with the readings of one stream changed."""
    return [replace(each, values=change(each.values)) if each.stream is stream else each for each in session(seconds)]


def tips(found: Outcome) -> np.ndarray:
    return np.array([each.estimate.tip for each in found.reports if each.estimate is not None])


@pytest.mark.parametrize("case", CASES)
def test_it_is_reported_and_not_used(case: str) -> None:
    stream, change, channels, told = CASES[case]
    found, right = run(rewired(stream, change, 8.0)), run(session(8.0))
    alarms = {(alarm.channel, alarm.kind, alarm.cause) for time, alarm in found.states() if time > 4.0}
    assert alarms == {(channel, "wiring", f"{channel}.sensor") for channel in channels}
    assert any(told in alarm.evidence and "mapping --check" in alarm.told for _, alarm in found.states())
    most = 0.25 if stream is Stream.STROKES else 6e-3  # angle sensors take the place of strokes; without them it is 2 m
    np.testing.assert_allclose(tips(found)[800:], tips(right)[800:], atol=most)


def test_a_wrong_unit_of_the_mapping_is_named_as_by_the_check_of_a_session() -> None:
    """The mapping says deg, and the encoders read rad."""
    names = [f"joint_{i}" for i in range(1, 5)]
    twin = Twin(load_scene(), health=True, declared={name: Channel(name, "deg") for name in names})
    found = run(rewired(Stream.ANGLES, np.radians, 8.0), twin=twin)
    told = {alarm.evidence.removeprefix("perhaps ") for time, alarm in found.states() if time > 4.0}
    assert told == {f"{name}, rad" for name in names}


def test_what_is_not_determined_is_not_almost_certain() -> None:
    """All angles are those of a straight boom, so angles or strokes are wrong."""
    found = run(rewired(Stream.ANGLES, lambda v: 0.0 * v, 8.0))
    wired = [alarm for _, alarm in found.states() if alarm.kind == "wiring" and alarm.until is None]
    assert any("perhaps" in alarm.evidence for alarm in wired)
    for alarm in wired:
        assert sum(each.probability for each in alarm.ranked) == pytest.approx(1.0)
        assert ("perhaps" in alarm.evidence) == (alarm.ranked[0].probability < 0.999)


def test_sensors_that_stopped_are_not_judged_by_what_they_read_before() -> None:
    """The angles' first reading is 0; a second source, which publishes zeros, then stops both."""
    zeros = rewired(Stream.ANGLES, lambda v: 0.0 * v, 8.0)
    first = next(each for each in zeros if each.stream is Stream.ANGLES)
    samples = [each for each in zeros if each is first or each.stream is not Stream.ANGLES]
    kinds = {(alarm.kind, alarm.channel) for _, alarm in run(samples).states()}
    assert kinds == {("dropout", "joint_angles")}


def test_a_start_with_right_readings_ends_it() -> None:
    wrong, right = rewired(Stream.ANGLES, lambda v: v[SWAP_23], 6.0), session(8.0)
    later = wrong[-1].stamp - right[0].stamp + 60_000_000_000  # after a pause the boom starts from rest
    found = run([*wrong, *(replace(each, stamp=each.stamp + later) for each in right)])
    ends = {alarm.channel for _, alarm in found.states() if alarm.kind == "wiring" and alarm.until is not None}
    assert ends == {"joint_2", "joint_3"}
    assert not [alarm for time, alarm in found.states() if time > 70.0 and alarm.until is None]


def test_a_sound_session_and_an_offset_are_no_wiring() -> None:
    offset = rewired(Stream.ANGLES, lambda v: v + np.array([0.0, 0.04, 0.0, 0.0]), 12.0)
    assert not run(session(12.0)).told()
    assert {alarm.kind for _, alarm in run(offset).states()} == {"deviation"}


def test_an_inclinometer_that_a_gyro_corrects_is_checked() -> None:
    """At the root of section 1 an inclinometer reads what an encoder reads."""
    reversed_3 = rewired(Stream.ANGLES, lambda v: v * [1, 1, -1, 1], 6.0)
    for samples, wrong in ((session(6.0), set()), (reversed_3, {"joint_3"})):
        twin = Twin(load_scene(), mounts=("root_compensated", None, None, None), health=True)
        assert {alarm.channel for time, alarm in run(samples, twin=twin).states() if time > 4.0} == wrong


def test_an_imu_elsewhere_is_checked_at_its_place() -> None:
    """The readings of the tip IMU, as those of another one at the tip; it is turned, by the mapping or against it."""
    turn = np.exp(-0.52j)
    samples = [
        replace(each, stream=Stream.IMU_2, values=np.array([read.real, read.imag]))
        if each.stream is Stream.IMU and (read := complex(*each.values) * turn)
        else each
        for each in session(8.0)
    ]
    for turned, wrong in ((0.52, set()), (0.0, {("imu_2", "wiring")})):
        twin = Twin(load_scene(), health=True, places={"imu_2": Place(turned=turned)})
        found = run(samples, twin=twin)
        assert {(alarm.channel, alarm.kind) for time, alarm in found.states() if time > 4.0} == wrong
