"""Which sessions the health benchmark has, most wanted first."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from boom_twin.scene import load_scene
from boom_twin.scene.schema import Scene
from boom_twin.validation.rig.faults import RigFault
from boom_twin.validation.rig.faulty_boom import wrong_by

WRONG = 0.02
INSTANCES = (1, 2, 3)
CYLINDERS = SECTIONS = JOINTS = (1, 2, 3, 4)
EACH = 20  # sessions of every fault and size
SHORT, LONG = 60.0, 120.0  # s
TESTS = 60
DEGREE = math.radians(1.0)

ANGLE_FAULTS = (
    ("bias", 0.1 * DEGREE), ("bias", 0.2 * DEGREE), ("bias", 0.5 * DEGREE), ("drift", 0.005 * DEGREE), ("drift", 0.02 * DEGREE),
    ("stuck", 0.0), ("noisy", 3.0), ("noisy", 10.0), ("spikes", 0.5 * DEGREE), ("spikes", 2.0 * DEGREE), ("dropout", 0.2),
    ("dropout", 1.0),
)  # fmt: skip
STROKE_FAULTS = (
    ("bias", 5e-4), ("bias", 1e-3), ("bias", 2e-3), ("scale", 0.005), ("scale", 0.01), ("scale", 0.02), ("stuck", 0.0),
    ("spikes", 1e-3), ("spikes", 5e-3), ("dropout", 0.2), ("dropout", 1.0),
)  # fmt: skip
STREAM_FAULTS = (
    ("joint_angles.delay", "late", 0.01), ("joint_angles.delay", "late", 0.03), ("joint_angles.delay", "late", 0.1),
    ("joint_angles.dropout", "missing", 1.0), ("cylinder_strokes.dropout", "missing", 1.0),
)  # fmt: skip


@dataclass(frozen=True)
class Job:
    """One session; `base` is the healthy one whose motion a sensor fault is put on."""

    group: str
    number: int
    instance: int
    duration: float
    fault: RigFault | None = None
    base: Job | None = None
    label: str = "healthy"

    @property
    def file(self) -> str:
        """Below the folder of all sessions."""
        return f"{self.group}/{self.label}_{self.number:02d}.npz"

    @cached_property
    def seed(self) -> int:
        """Of the moves, the noise, and what a fault draws."""
        return zlib.crc32(self.file.encode())

    @property
    def posture(self) -> str:
        """Where it starts."""
        names = sorted(load_scene().postures)
        return names[int(np.random.default_rng([self.seed, 3]).integers(len(names)))]

    @property
    def entry(self) -> dict[str, Any]:
        """Its line in the index."""
        fault = self.fault
        told = {key: None if fault is None else getattr(fault, key) for key in ("cause", "kind", "size", "onset")}
        start = {"posture": self.posture} if self.base is None else {"base": self.base.file}
        where = {"file": self.file, "group": self.group, "instance": self.instance}
        return {**where, **told, "seed": self.seed, "duration": self.duration, **start}


@lru_cache
def instance(number: int) -> Scene:
    """The boom that is simulated: 0 the default scene, the others wrong by 2 %."""
    return wrong_by(load_scene(), WRONG, number) if number else load_scene()


def jobs() -> list[Job]:
    """All sessions."""
    learn = [Job("learn", i, INSTANCES[i % 3], SHORT) for i in range(15)]
    right = [Job("right", i, 0, SHORT) for i in range(6)]
    test = [Job("test", i, INSTANCES[i % 3], LONG) for i in range(TESTS)]
    wanted = [_softer(1, 0.3), _softer(2, 0.3), _softer(3, 0.3), _softer(4, 0.4), RigFault("tip.payload", "more", 20.0)]
    return [*learn, *right, *_physical(wanted), *test, *_sensors(test), *_physical(_sizes()), *_physical(_clearances())]


def _softer(cylinder: int, share: float) -> RigFault:
    return RigFault(f"cylinder_{cylinder}.k", "softer", share)


def _sizes() -> list[RigFault]:
    """The physical faults in other sizes."""
    return [
        *(_softer(i, 0.15) for i in CYLINDERS),
        RigFault("tip.payload", "more", 10.0),
        *(RigFault("line_fill", "more", size) for size in (2.0, 5.0)),
        *(RigFault(f"section_{i}.EI", "softer", share) for i in SECTIONS for share in (0.1, 0.2)),
        *(_softer(i, 0.5) for i in CYLINDERS),
        *(RigFault("tip.payload", "more", size) for size in (5.0, 40.0)),
    ]


def _clearances() -> list[RigFault]:
    return [RigFault(f"cylinder_{i}.rod.clearance", "play", size) for size in (5e-4, 1e-3, 2e-4) for i in CYLINDERS]


def _physical(faults: list[RigFault]) -> Iterator[Job]:
    """All faults before a second session of any."""
    for number in range(EACH):
        for fault in faults:
            label = f"{fault.cause}_{fault.kind}_{fault.size:g}"
            yield Job("physical", number, INSTANCES[number % 3], SHORT, fault, label=label)


def _sensors(healthy: list[Job]) -> Iterator[Job]:
    """Sensor faults on the first 60 s of healthy tests, each time of another sensor."""
    one = [("joint", kind, size, at_start) for kind, size in ANGLE_FAULTS for at_start in _starts(kind)]
    one += [("cylinder", kind, size, at_start) for kind, size in STROKE_FAULTS for at_start in _starts(kind)]
    for number in range(EACH):
        base = healthy[(7 * number) % TESTS]
        for owner, kind, size, at_start in one:
            cause = f"{owner}_{JOINTS[number % 4]}.sensor"
            label = f"{owner}.sensor_{kind}_{size:.3g}" + ("_from_start" if at_start else "")
            yield _spoilt(base, number, label, RigFault(cause, kind, size), at_start)
        for cause, kind, size in STREAM_FAULTS:
            yield _spoilt(base, number, f"{cause}_{kind}_{size:g}", RigFault(cause, kind, size), False)


def _starts(kind: str) -> tuple[bool, ...]:
    return (False, True) if kind in ("bias", "scale") else (False,)


def _spoilt(base: Job, number: int, label: str, fault: RigFault, at_start: bool) -> Job:
    draw = np.random.default_rng([zlib.crc32(f"{label}_{number}".encode()), 4])
    onset = 0.0 if at_start else round(float(draw.uniform(10.0, 40.0)), 3)
    return Job("sensor", number, base.instance, SHORT, RigFault(fault.cause, fault.kind, fault.size, onset), base, label)
