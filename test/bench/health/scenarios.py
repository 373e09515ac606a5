"""Which sessions the health benchmark has: each drawn from its number alone, so that more can be added at any time.

What is drawn: whether there is a fault, its cause, size, onset, ramp and end, a second one; pump and wind; noise, rate and
sensors; the rig, whose parameters are right or 2 % wrong. A fifth of all numbers is held out: see `Scenario.is_held_out`.

Numbers below 5000 are of the default boom at 50 to 500 Hz; from 5000 on of a five-section boom that folds in a Z, at 50 to 1000
Hz; from 7000 on of the default boom at 1000 Hz. From 8000 on they are of the targets alone, see `_target`: quiet ones, and from
9000 on ones under a load; of these every other six are held out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from boom_twin.scene import load_scene
from boom_twin.scene.edit import with_parameters
from boom_twin.scene.load import examine_text, example_text
from boom_twin.scene.schema import Scene
from boom_twin.validation.rig import Sensors
from boom_twin.validation.rig.faults import RigFault
from boom_twin.validation.rig.faulty_boom import wrong_by
from boom_twin.validation.rig.loads import PumpLoad, RigLoad, WindLoad

WRONG, RIGS = 0.02, 3  # rig 0 has the scene's own parameters
DURATION, LEARNING = 80.0, 60.0  # s
LEARN_EACH = 3  # healthy sessions that a baseline is learnt from, of each rig that is wrong
DEGREE = math.radians(1.0)
SIZES: dict[str, tuple[float, ...]] = {
    "k": (0.3, 0.4), "EI": (0.2, 0.3, 0.4), "payload": (20.0,), "line_fill": (5.0,),
    "joint bias": (0.1 * DEGREE, 0.5 * DEGREE), "joint drift": (0.005 * DEGREE, 0.02 * DEGREE), "joint stuck": (0.0,),
    "cylinder bias": (5e-4, 2e-3), "cylinder drift": (5e-5,), "cylinder scale": (0.01,),
}  # fmt: skip
"""Of each kind of fault, SI; all kinds are drawn alike, cylinders twice as often."""
RATES = {50.0: 0.1, 100.0: 0.2, 200.0: 0.6, 500.0: 0.1}  # Hz, and how often
Z_FOLD, Z_FOLD_FROM, FAST_FROM = "five_section_z_fold", 5000, 7000  # an example scene; numbers
Z_FOLD_RATES = {50.0: 0.1, 100.0: 0.2, 200.0: 0.4, 1000.0: 0.3}
TARGETS_FROM, SHAKEN_FROM = 8000, 9000  # numbers
TARGETS = (
    *((f"cylinder_{i}.k", "softer", 0.4 if i == 4 else 0.3) for i in range(1, 5)),
    ("tip.payload", "more", 20.0),
    ("tip.payload", "less", 20.0),
)
LOADED, PAYLOAD = "loaded", 60.0  # the default boom with an end hose, kg: who loses a payload has one
GROUPS = {"healthy": 0.4, "one": 0.42, "recovery": 0.08, "two": 0.1}


@dataclass(frozen=True)
class Scenario:
    """One session; `number` < 0 are those that baselines are learnt from."""

    number: int
    group: str
    rig: int
    posture: str
    duration: float
    faults: tuple[RigFault, ...]
    loads: tuple[RigLoad, ...]
    noise: float
    rate: float
    streams: tuple[str, ...]
    scene: str = ""

    @property
    def model(self) -> Scene:
        """The boom as its scene file has it."""
        return nominal(self.scene)

    @property
    def boom(self) -> Scene:
        """The boom that is simulated, without its faults."""
        return wrong_by(self.model, WRONG, self.rig) if self.rig else self.model

    @property
    def seed(self) -> int:
        """Of the moves, the wind, the noise, and what a fault draws."""
        return 5000 + self.number

    @property
    def is_held_out(self) -> bool:
        """Whether it is not to be looked at while health is being worked on."""
        if self.number >= TARGETS_FROM:
            return self.number // len(TARGETS) % 2 == 1
        return self.number % 5 == 4

    @property
    def sensors(self) -> Sensors:
        """As they are, not as stated."""
        own = Sensors(self.rate)
        names = ("stroke_sigma", "angle_sigma", "imu_sigma", "force_sigma")
        return replace(own, **{name: self.noise * getattr(own, name) for name in names})

    @property
    def row(self) -> dict[str, Any]:
        """What is true of it, as a row of the results."""
        return {
            "number": self.number, "group": self.group, "rig": self.rig, "posture": self.posture, "duration": self.duration,
            "faults": [str(fault) for fault in self.faults], "causes": [fault.cause for fault in self.faults],
            "loads": [str(load) for load in self.loads], "noise": self.noise, "rate": self.rate, "streams": self.streams,
            "scene": self.scene,
        }  # fmt: skip


@lru_cache
def nominal(name: str) -> Scene:
    """The default scene, the same with a payload, or an example by its name."""
    if not name:
        return load_scene()
    if name == LOADED:
        return with_parameters(load_scene(), {"tip.payload": PAYLOAD})
    found, _ = examine_text(example_text(name), name)
    assert found is not None
    return found


def learning(scene: str = "") -> list[Scenario]:
    """Healthy sessions of the rigs of a boom that are wrong."""
    streams, first = ("angles", "imu"), {"": -1, Z_FOLD: -101, LOADED: -201}[scene]
    names = sorted(nominal(scene).postures)
    pairs = [(rig, k) for rig in range(1, RIGS) for k in range(LEARN_EACH)]
    return [
        Scenario(first - i, "learn", rig, names[k % len(names)], LEARNING, (), (), 1.0, 200.0, streams, scene)
        for i, (rig, k) in enumerate(pairs)
    ]


def scenario(number: int) -> Scenario:
    """The session of a number, from 0."""
    if number >= TARGETS_FROM:
        return _target(number)
    scene = Z_FOLD if Z_FOLD_FROM <= number < FAST_FROM else ""
    rates = {1000.0: 1.0} if number >= FAST_FROM else Z_FOLD_RATES if scene else RATES
    rng = np.random.default_rng([number, 17])
    group = str(rng.choice(list(GROUPS), p=list(GROUPS.values())))
    streams = ("angles", *(["imu"] if rng.random() < 0.8 else []), *(["forces"] if rng.random() < 0.2 else []))
    noise = float(rng.choice([0.5, 1.0, 2.0], p=[0.15, 0.7, 0.15]))
    rate = float(rng.choice(list(rates), p=list(rates.values())))
    posture = str(rng.choice(sorted(nominal(scene).postures)))
    rig, faults = int(rng.integers(RIGS)), _faults(group, rng, len(nominal(scene).joints))
    return Scenario(number, group, rig, posture, DURATION, faults, _loads(rng), noise, rate, streams, scene)


def _target(number: int) -> Scenario:
    """What issues a target: one fault of a size and cause that follow from the number, over 0.05 to 30 s, with IMU, at 200 Hz.

    Half of those under a load have a pump of 130 N and a wind of 15 N, a quarter each only one of them.
    """
    rng = np.random.default_rng([number, 17])
    cause, kind, size = TARGETS[number % len(TARGETS)]
    scene = LOADED if kind == "less" else ""
    ramp, onset = float(rng.choice([0.05, 2.0, 5.0, 15.0, 30.0])), round(float(rng.uniform(5.0, 15.0)), 2)
    pump, wind = PumpLoad(round(float(rng.uniform(0.2, 0.6)), 3), 130.0), WindLoad(15.0)
    loads = [(pump, wind), (pump, wind), (pump,), (wind,)][int(rng.integers(4))]
    streams = ("angles", "imu", *(["forces"] if rng.random() < 0.3 else []))
    posture, rig = str(rng.choice(sorted(nominal(scene).postures))), int(rng.integers(RIGS))
    faults = (RigFault(cause, kind, size, onset, ramp),)
    shaken = loads if number >= SHAKEN_FROM else ()
    return Scenario(number, "target", rig, posture, DURATION, faults, shaken, 1.0, 200.0, streams, scene)


def _loads(rng: np.random.Generator) -> tuple[RigLoad, ...]:
    """None in half of the sessions, else a pump, a wind, or both."""
    return draw_loads(rng, str(rng.choice(["none", "pump", "wind", "both"], p=[0.5, 0.2, 0.1, 0.2])))


def draw_loads(rng: np.random.Generator, kind: str) -> tuple[RigLoad, ...]:
    """Loads of a kind: none, pump, wind or both."""
    onset = float(rng.choice([0.0, 5.0]))
    height = float(np.exp(rng.uniform(np.log(30.0), np.log(300.0))))
    pump = PumpLoad(round(float(rng.uniform(0.2, 0.6)), 3), round(height, 1), onset=onset)
    wind = WindLoad(round(float(rng.uniform(10.0, 60.0)), 1))
    return {"none": (), "pump": (pump,), "wind": (wind,), "both": (pump, wind)}[kind]


def _faults(group: str, rng: np.random.Generator, joints: int) -> tuple[RigFault, ...]:
    if group == "healthy":
        return ()
    ramp = float(rng.choice([0.0, 0.05, 2.0, 5.0, 15.0, 30.0]))
    first = _fault(rng, joints, float(rng.choice([0.0, rng.uniform(5.0, 15.0)])), ramp)
    if group == "recovery":
        ramp = min(first.ramp, 5.0)
        return (replace(first, ramp=ramp, end=max(50.0, first.onset + ramp + 30.0)),)
    if group == "one":
        return (first,)
    while (second := _fault(rng, joints, float(rng.uniform(35.0, 45.0)), 0.05)).cause == first.cause:
        pass
    return first, second


def _fault(rng: np.random.Generator, joints: int, onset: float, ramp: float) -> RigFault:
    kind = str(rng.choice([*SIZES, "k", "k", "payload"]))
    size, i = float(rng.choice(SIZES[kind])), int(rng.integers(1, joints + 1))
    if kind == "k":
        return RigFault(f"cylinder_{i}.k", "softer", 0.4 if i >= 4 else 0.3, onset, ramp)
    if kind == "EI":
        return RigFault(f"section_{i}.EI", "softer", size, onset, ramp)
    if kind in ("payload", "line_fill"):
        return RigFault("tip.payload" if kind == "payload" else kind, "more", size, onset, ramp)
    owner, what = kind.split()
    ramp = 0.0 if what in ("drift", "stuck") else ramp
    return RigFault(f"{owner}_{i}.sensor", what, size, onset, ramp)
