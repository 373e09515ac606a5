"""Pressures of both sides of a cylinder become its force when they are decoded."""

from __future__ import annotations

from math import hypot, pi
from pathlib import Path

import numpy as np
import pytest
from recordings import load_mapping
from ros_messages import SampleDecoder, Topics, new_message

from boom_twin import Scene, Settings, Stream, UsageError, load_scene

SCENE = load_scene()
BORE, ROD = (0.16, 0.16, 0.12, 0.10), (0.09, 0.09, 0.07, 0.06)
PISTON = pi / 4 * np.square(BORE)
RING = PISTON - pi / 4 * np.square(ROD)
MAPPING = f"inputs:\n  cylinder_pressures: {{bore: {[*BORE]}, rod: {[*ROD]}}}\nsensors:\n  cylinder_2_cap: {{unit: bar}}\n"


def mapped(tmp_path: Path, text: str, scene: Scene = SCENE) -> Topics:
    path = tmp_path / "mapping.yaml"
    path.write_text(text)
    return load_mapping(path, 4).of_scene(scene.joints)


def test_they_become_forces_positive_in_tension(tmp_path: Path) -> None:
    topics = mapped(tmp_path, MAPPING)
    assert topics.heard["cylinder_pressures"] == [Stream.PRESSURES]
    cap, rod = np.array([2e6, 3e6, 0.0, 150e5]), np.array([1e6, 0.0, 40e5, 10e5])
    msg = new_message("sensor_msgs/msg/JointState")
    msg.header.stamp.sec = 5
    msg.name = [f"cylinder_{i}_{side}" for side in ("cap", "rod") for i in (1, 2, 3, 4)]
    msg.effort = np.concatenate([cap, rod])
    msg.effort[1] = 30.0  # bar
    decoder = SampleDecoder(4, topics)
    (sample,) = decoder.samples(topics.heard["cylinder_pressures"], 5 * 10**9, msg)
    assert sample.stream is Stream.FORCES
    assert sample.values == pytest.approx(rod * RING - cap * PISTON, rel=1e-12)
    assert sample.values[2] > 0.0 > sample.values[1], "the rod side pulls"
    assert not decoder.oddities
    msg.name = msg.name[:7]  # without the rod side of the last
    (sample,) = decoder.samples(topics.heard["cylinder_pressures"], 6 * 10**9, msg) or list(decoder.assembler.rest())
    assert np.isnan(sample.values).tolist() == [False, False, False, True]


def test_their_noise_is_that_of_the_forces(tmp_path: Path) -> None:
    settings = Settings(pressure_sigma=2e4)
    assert mapped(tmp_path, MAPPING).noise_of(settings).force_sigma == pytest.approx(2e4 * hypot(PISTON[3], RING[3]))
    assert mapped(tmp_path, "").noise_of(settings) is settings


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "inputs: {cylinder_pressures: {required: true}}",
            "oil: {bore, rod, ..}` to each cylinder of the scene, or bore and rod",
        ),
        ("inputs: {cylinder_pressures: {bore: [0.1], rod: [0.05]}}", "1 and 1 entries, the scene has 4 cylinders"),
        ("inputs: {tip_imu: {bore: [0.1]}}", "only cylinder_pressures has it"),
        ("sensors: {cylinder_5_cap: {unit: bar}}", "the scene has 4 joints"),
    ],
)
def test_what_is_missing_or_wrong_is_told(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(UsageError) as error:
        mapped(tmp_path, text)
    assert told in str(error.value)
