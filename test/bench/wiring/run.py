"""The benchmark of the commissioning check: sessions that are rewired at random, by their numbers.

    python test/bench/wiring/run.py --first 0 --count 200

Sessions are the bundled ones, and simulated ones of three booms with random moves, whose parameters are 2 % off. Encoders have
zeros of 0.1 deg (standard deviation), the IMU 0.1 m/s^2. A third is 5 s long, often at rest. Up to two wirings are wrong.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections import Counter, defaultdict
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.record import keep
from recordings import read, scan, scene_of

from boom_twin import Scene, load_scene, simulate
from boom_twin.sensor_kinds import G
from boom_twin.types import SENSORS, Channel, Stream, StrokeReading
from boom_twin.validation.rig.faults import wrong_by
from boom_twin.validation.rig.motion import random_programme
from boom_twin.wiring.check import Verdict, check
from boom_twin.wiring.readings import RestModel, Series

ROOT = Path(__file__).parents[3]
BUNDLED = "arch_session", "pump_session"
BOOMS = None, ROOT / "boom_twin/examples/five_section_z_fold.yaml", ROOT / "examples/two_section_boom.yaml"
STEP, DURATION, SHORT = 0.01, 60.0, 500  # s, s, rows
ANGLES, STROKES, FORCES, IMU = Stream.ANGLES, Stream.STROKES, Stream.FORCES, Stream.IMU
Rng = np.random.Generator


class Base(NamedTuple):
    """Healthy session: scene, and readings (rows, channels) by stream; those of the IMU along x, y and z."""

    scene: Scene
    readings: dict[Stream, np.ndarray]


@cache
def bundled(name: str) -> Base:
    session, rows = scan(ROOT / "bags" / name), defaultdict(list)
    types = {stream.value: SENSORS[stream].message for stream in Stream if session.find(stream.value) is not None}
    for topic, _, msg in read(session, types):
        force = getattr(msg, "linear_acceleration", None)
        own = None if force is None else (force.x, force.y, force.z)
        rows[topic].append(own or (msg.effort if topic == FORCES.value else msg.position))
    return Base(scene_of(session.path).scene, {Stream(key): np.array(each)[::2] for key, each in rows.items()})


@cache
def simulated(boom: Path | None, seed: int) -> Base:
    scene, times = load_scene(boom), np.arange(0.0, DURATION, STEP)
    posture = sorted(scene.postures)[seed % len(scene.postures)]
    strokes = random_programme(scene, posture, DURATION, seed)(times)[0]
    found = simulate(wrong_by(scene, 0.02, seed), times, strokes, dt=5e-3, estimate_errors=False)
    tip, head = found.tip_acceleration, found.tip[:, 2]
    f = (tip[:, 0] + 1j * (tip[:, 1] + G)) * np.exp(-1j * head)
    rng, n = np.random.default_rng(seed), len(scene.joints)
    imu = np.column_stack([f.real, np.zeros(len(f)), f.imag]) + rng.normal(0.0, 0.1, 3) + rng.normal(0.0, 0.05, (len(f), 3))
    joints = found.joints + rng.normal(0.0, np.radians(0.1), n) + rng.normal(0.0, 2e-4, found.joints.shape)
    return Base(scene, {STROKES: found.lengths, ANGLES: joints, IMU: imu, FORCES: found.cylinder_forces})


class Wired:
    """Session with its wiring: readings by name, and what is true of every rewired channel."""

    def __init__(self, base: Base, rows: slice, rng: Rng) -> None:
        self.scene, self.n, self.rng = base.scene, len(base.scene.joints), rng
        self.truth: dict[str, Channel | None] = {}
        values = {stream: each[rows] for stream, each in base.readings.items()}
        self.columns = {
            stream: {name: values[stream][:, i] for i, name in enumerate(names)}
            for stream, names in self.names.items()
            if stream in values
        }

    @property
    def names(self) -> dict[Stream, list[str]]:
        found = {s: [f"{SENSORS[s].named}_{i + 1}" for i in range(self.n)] for s in (STROKES, ANGLES, FORCES)}
        return found | {IMU: ["x", "y", "z"]}

    def declared(self, stream: Stream) -> list[Channel]:
        names = ["x", "z"] if stream is IMU else self.names[stream]
        return [Channel(name, SENSORS[stream].unit) for name in names]

    def set(self, stream: Stream, i: int, **ways: Any) -> None:
        channel = SENSORS[stream].channels(self.n)[i]
        before = self.truth.get(channel) or self.declared(stream)[i]
        self.truth[channel] = before._replace(**ways)

    def swap(self, stream: Stream) -> None:
        i, j = self.rng.choice(self.n, 2, replace=False).tolist()
        own, (one, two) = self.columns[stream], (self.names[stream][k] for k in (i, j))
        own[one], own[two] = own[two], own[one]
        self.set(stream, i, name=two)
        self.set(stream, j, name=one)

    def scale(self, stream: Stream, unit: str) -> None:
        for i, name in enumerate(self.names[stream]):
            self.columns[stream][name] = self.columns[stream][name] / SENSORS[stream].units[unit]
            if stream is not IMU or i < 2:
                self.set(stream, i, unit=unit)

    def some_unit(self, stream: Stream) -> None:
        self.scale(stream, str(self.rng.choice(list(SENSORS[stream].units)[1:])))

    def reverse(self, stream: Stream, all_of_them: bool = False) -> None:
        for i in range(self.n) if all_of_them else [int(self.rng.integers(self.n))]:
            self.columns[stream][self.names[stream][i]] = -self.columns[stream][self.names[stream][i]]
            self.set(stream, i, sign=-1)

    def shift(self, zero: float) -> None:
        i = int(self.rng.integers(self.n))
        self.columns[ANGLES][self.names[ANGLES][i]] = self.columns[ANGLES][self.names[ANGLES][i]] + zero
        self.set(ANGLES, i, zero=zero)

    def from_far_end(self) -> None:
        i = int(self.rng.integers(self.n))
        longest = self.scene.joints[i].cylinder.max_stroke
        self.columns[STROKES][self.names[STROKES][i]] = longest - self.columns[STROKES][self.names[STROKES][i]]
        self.set(STROKES, i, sign=-1, zero=longest)

    def absolute(self) -> None:
        total = np.cumsum([self.columns[ANGLES][name] for name in self.names[ANGLES]], axis=0)
        for i, name in enumerate(self.names[ANGLES]):
            self.columns[ANGLES][name] = total[i] + self.scene.base.inclination
            if i:
                self.set(ANGLES, i, absolute="root")

    def rename(self) -> None:
        order = self.rng.permutation(self.n).tolist()
        columns = {f"enc_{order[i]}": self.columns[ANGLES][name] for i, name in enumerate(self.names[ANGLES])}
        self.columns[ANGLES] = columns
        for i in range(self.n):
            self.set(ANGLES, i, name=f"enc_{order[i]}")

    def axes(self, x: str, z: str, sign: int = 1) -> None:
        own = dict(self.columns[IMU])
        spare = next(axis for axis in ("y", "x", "z") if axis not in (x, z))
        self.columns[IMU] = {x: sign * own["x"], z: own["z"], spare: own["y"]}
        self.set(IMU, 0, name=x, sign=sign)
        self.set(IMU, 1, name=z)

    def turn(self) -> None:
        by = float(self.rng.choice([-1, 1]) * np.radians(self.rng.uniform(15.0, 75.0)))
        f = (self.columns[IMU]["x"] + 1j * self.columns[IMU]["z"]) * np.exp(-1j * by)
        self.columns[IMU] |= {"x": f.real, "z": f.imag}
        self.set(IMU, 0, turned=by)
        self.set(IMU, 1, turned=by)

    def no_gravity(self) -> None:
        lengths = np.column_stack([self.columns[STROKES][name] for name in self.names[STROKES]])
        at = np.linspace(0, len(lengths) - 1, 60).astype(int)
        g = RestModel(self.scene, StrokeReading.LENGTH).expected(lengths[at]).gravity[IMU]
        for axis, part in (("x", g.real), ("z", g.imag)):
            self.columns[IMU][axis] = self.columns[IMU][axis] - np.interp(np.arange(len(lengths)), at, part)
        self.truth |= {"tip_imu_x": None, "tip_imu_z": None}


WIRINGS: dict[str, tuple[Stream, Callable[[Wired], None]]] = {
    "two encoders swapped": (ANGLES, lambda w: w.swap(ANGLES)),
    "encoders by other names": (ANGLES, lambda w: w.rename()),
    "an encoder of the other sign": (ANGLES, lambda w: w.reverse(ANGLES)),
    "angles in another unit": (ANGLES, lambda w: w.some_unit(ANGLES)),
    "an encoder half a turn off": (ANGLES, lambda w: w.shift(np.pi)),
    "an encoder 10 to 70 deg off": (ANGLES, lambda w: w.shift(float(w.rng.choice([-1, 1]) * w.rng.uniform(0.2, 1.2)))),
    "inclinometers for encoders": (ANGLES, lambda w: w.absolute()),
    "two strokes swapped": (STROKES, lambda w: w.swap(STROKES)),
    "strokes in another unit": (STROKES, lambda w: w.some_unit(STROKES)),
    "a stroke of the other sign": (STROKES, lambda w: w.reverse(STROKES)),
    "a stroke from its far end": (STROKES, lambda w: w.from_far_end()),
    "two forces swapped": (FORCES, lambda w: w.swap(FORCES)),
    "forces in another unit": (FORCES, lambda w: w.some_unit(FORCES)),
    "forces positive in compression": (FORCES, lambda w: w.reverse(FORCES, all_of_them=True)),
    "IMU in g or mg": (IMU, lambda w: w.some_unit(IMU)),
    "IMU, x and z swapped": (IMU, lambda w: w.axes("z", "x")),
    "IMU, x backwards": (IMU, lambda w: w.axes("x", "z", -1)),
    "IMU, y for z": (IMU, lambda w: w.axes("x", "y")),
    "IMU turned by 15 to 75 deg": (IMU, lambda w: w.turn()),
    "IMU without gravity": (IMU, lambda w: w.no_gravity()),
}


def is_right(verdict: Verdict, truth: Channel | None) -> bool:
    """Return True if a proposal is what was done; the place of an inclinometer on its section does not matter."""
    best = verdict.best
    if truth is None or best is None:
        return verdict.has_no_gravity and truth is None
    near = (
        abs(np.remainder(best.zero - truth.zero + np.pi, 2.0 * np.pi) - np.pi) < 0.03 and abs(best.turned - truth.turned) < 0.03
    )
    is_same = (best.name, best.unit, best.sign) == (truth.name, truth.unit, truth.sign)
    return is_same and bool(near) and not verdict.has_no_gravity and (best.absolute is None) == (truth.absolute is None)


def judged(number: int) -> tuple[str, bool, Counter[str]]:
    """Rewire and check the session of a number; return what was done, whether the boom moved, and counts of channels."""
    rng = np.random.default_rng([number, 36])
    choice = int(rng.integers(2 + 2 * len(BOOMS)))
    base = bundled(BUNDLED[choice]) if choice < 2 else simulated(BOOMS[choice % len(BOOMS)], int(rng.integers(8)))
    length = len(base.readings[STROKES])
    first = int(rng.integers(length - SHORT)) if rng.random() < 0.33 else None
    wired = Wired(base, slice(None) if first is None else slice(first, first + SHORT), rng)
    done: dict[Stream, str] = {}
    for name in rng.choice(list(WIRINGS), int(rng.choice([0, 1, 1, 2])), replace=False).tolist():
        stream, wire = WIRINGS[name]
        if stream in wired.columns and stream not in done:
            wire(wired)
            done[stream] = name
    rows = len(next(iter(wired.columns[STROKES].values())))
    stamps = 10**18 + np.arange(rows) * round(STEP * 1e9)
    window = {s: {name: Series(stamps, each) for name, each in own.items()} for s, own in wired.columns.items()}
    found = check(RestModel(wired.scene, StrokeReading.LENGTH), {s: wired.declared(s) for s in wired.names}, window)
    counts: Counter[str] = Counter()
    assert found is not None and not found.is_other_boom, number
    for verdict in found.verdicts:
        truth = wired.truth.get(verdict.channel, verdict.declared)
        if truth == verdict.declared:
            counts["right channels, another proposed"] += verdict.is_sure
        else:
            kind = ("right" if is_right(verdict, truth) else "wrong") if verdict.is_sure else "not determined"
            counts[kind if verdict.is_wrong else "not noticed"] += 1
        if verdict.is_sure and not is_right(verdict, truth):
            print(f"  session {number}: {verdict.channel} is {truth}, proposed {verdict.best}", file=sys.stderr)
    label = " and ".join(done.values()) if len(done) < 2 else "two of them"
    return label or "none", found.moved, counts


def main() -> None:
    """Print a table of all sessions by wiring."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=200)
    args = parser.parse_args()
    table: dict[str, Counter[str]] = defaultdict(Counter)
    total: Counter[str] = Counter()
    for number in range(args.first, args.first + args.count):
        label, moved, counts = judged(number)
        table[f"{label}{'' if moved else ', at rest'}"].update(counts + Counter(sessions=1))
        total.update(counts + Counter(sessions=1))
    for label, counts in sorted(table.items()):
        print(f"{label}: {dict(counts)}")
    print(dict(total))
    keep("wiring", dict(total))


if __name__ == "__main__":
    main()
