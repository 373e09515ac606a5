"""Reports of anything that a twin may tell, made up: odd numbers too, several residuals at once, news of health, outlines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from boom_twin import Report, Scene, Stream, load_scene
from boom_twin.deviation.estimate_row import WIDTH
from boom_twin.predictions import Prediction
from boom_twin.twin.blocks import estimate_of
from boom_twin.types import Alarm, Array, Change, Health, Ranked, Residuals, channels_of

START, STEP = 1_700_000_000_000_000_000, 1_666_667
POINTS = 7
ODD = np.array([0x7FF8_0000_0000_0ABC, 0xFFF8_0000_0000_0000, 0x8000_0000_0000_0000, 1], np.uint64).view(np.float64)
"""Two NaN that differ, -0.0, the least number above 0."""


def boom(joints: int) -> Scene:
    """The default boom's first sections."""
    scene = load_scene()
    return scene.model_copy(update={"sections": scene.sections[:joints], "joints": scene.joints[:joints], "postures": {}})


@dataclass(frozen=True)
class Told:
    """What reports tell of: a boom with so many joints and pins with clearance; shares of samples with news, or an outline."""

    joints: int
    imu: bool = True
    pins: int = 0
    health: float = 0.02
    changes: float = 0.0
    outlines: float = 0.2


def random_reports(seed: int, count: int, told: Told) -> list[Report]:
    """Reports of one session."""
    random = np.random.default_rng(seed)
    stamps = START + np.cumsum(random.integers(-STEP // 3, 3 * STEP, count))
    return [_report(random, int(stamp), told) for stamp in stamps]


def _report(random: np.random.Generator, stamp: int, told: Told) -> Report:
    streams = [Stream.STROKES, Stream.ANGLES, *([Stream.IMU] if told.imu else [])]
    chosen = random.integers(0, len(streams), random.choice([0, 1, 2, 5], p=[0.4, 0.4, 0.1, 0.1]))
    prediction = _prediction(random, stamp, told) if random.random() < 0.4 else None
    return Report(
        stamp,
        True,
        prediction,
        tuple(_residuals(random, stamp, streams[k], told.joints) for k in chosen),
        change=Change(stamp, True, {"load": 1.5}, {"joint_1": 0.01}) if random.random() < told.changes else None,
        health=_health(random, stamp) if random.random() < told.health else None,
        estimate=None if prediction is None else estimate_of(prediction.stamp, random.normal(size=WIDTH)),
    )


def _prediction(random: np.random.Generator, stamp: int, told: Told) -> Prediction:
    outline: dict[str, Any] = {"shape": None}
    if random.random() < told.outlines:
        shapes = {"shape": (POINTS, 2), "undeflected": (POINTS, 2), "pins": (told.joints, 4)}
        outline = {name: _numbers(random, shape) for name, shape in shapes.items()}
    return Prediction(
        stamp=stamp + int(random.integers(-2, 3)),
        **{name: _numbers(random, 2) for name in ("tip_position", "tip_displacement", "tip_velocity", "tip_acceleration")},
        **{name: float(_numbers(random, 1)[0]) for name in ("tip_angle", "tip_angular_velocity", "tip_angular_acceleration")},
        joints=_numbers(random, told.joints),
        strokes=_numbers(random, told.joints),
        cylinder_forces=1e5 * _numbers(random, told.joints),
        clearances=_numbers(random, (told.pins, 4)),
        moments=_numbers(random, 5),
        **outline,
    )


def _residuals(random: np.random.Generator, stamp: int, stream: Stream, joints: int) -> Residuals:
    names = channels_of(joints)[stream]
    sigmas = np.where(random.random(len(names)) < 0.05, np.nan, random.uniform(1e-5, 1e-3, len(names)))
    return Residuals(stream, stamp - int(random.integers(0, 10**7)), names, _numbers(random, len(names)), sigmas)


def _health(random: np.random.Generator, stamp: int) -> Health:
    ranked = (Ranked("cylinder_1.k", 0.9, (("softer", 0.4, 0.02, ""),)),)
    alarm = Alarm("joint_1", "softer", stamp - 10**9, None, "cylinder_1.k", "softer " * int(random.integers(1, 9)), ranked)
    alarms = (alarm,) * int(random.integers(0, 3))
    return Health(stamp - int(random.integers(0, 10**8)), alarms, random.random(2))


def _numbers(random: np.random.Generator, shape: int | tuple[int, ...]) -> Array:
    """Some of them odd."""
    numbers = random.normal(size=shape)
    return np.where(random.random(shape) < 0.05, random.choice(ODD, shape), numbers)
