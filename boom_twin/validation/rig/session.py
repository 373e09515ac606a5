"""Sensor model of the virtual rig (noise, resolution, jitter), and synthetic sessions recorded by it.

Synthetic by construction: parameters of scene and sensors are surrogates, and no hardware took part. The instant of sampling
is the stamp itself.
"""

from __future__ import annotations

import gzip
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from ...errors import UsageError
from ...scene.kinematics import gravity_in_base
from ...scene.schema import Scene
from ...system.files import write_atomic
from ...types import NO_PLACES, SECOND, Array, Place, Stream
from .solve import Change, Drive, TipLoad, simulate
from .system import Site

EPOCH = 1_700_000_000 * SECOND  # stamp (ns) of the start of every session
POINT_PERIOD = 1.0  # s, of a total station
BACK_PRESSURE = 1e6  # Pa


RATE = 200.0  # Hz
RATES = 50.0, 1000.0  # Hz: jitter reaches half the time between two samples at 2500 Hz, and a motion is recorded at 1000 Hz


@dataclass(frozen=True, slots=True)
class Sensors:
    """Sampling and noise: Hz, s, m, rad, m/s^2, rad/s, N, N m, Pa; a resolution of zero means no rounding.

    Standard deviations are those before rounding. Forces are as of load pins, or of pressures in both chambers: 100 N is a
    thousandth of what the largest cylinder of the default scene bears. UsageError unless the rate is within `RATES`.
    """

    rate: float = RATE
    jitter: float = 2e-4
    stroke_sigma: float = 2e-5
    stroke_resolution: float = 5e-6
    angle_sigma: float = math.radians(0.01)
    angle_resolution: float = math.radians(0.005)
    imu_sigma: float = 0.05
    rate_sigma: float = 2e-3
    force_sigma: float = 100.0
    force_resolution: float = 20.0
    moment_sigma: float = 50.0
    point_sigma: float = 2e-3
    pressure_sigma: float = 1e4

    def __post_init__(self) -> None:
        low, high = RATES
        if not low <= self.rate <= high:
            raise UsageError(f"rate = {self.rate:g}, must be from {low:g} to {high:g} Hz, at which the sensors are sampled.")


def sampling_stamps(sensors: Sensors, duration: float, start: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Draw stamps (ns, int64) within `duration` (s) after `start` (ns), uniformly jittered about the grid.

    The grid begins half a period after the start, so that no jitter reaches beyond either end.
    """
    count = round(duration * sensors.rate)
    instants = (np.arange(count) + 0.5) / sensors.rate + rng.uniform(-sensors.jitter, sensors.jitter, count)
    return start + np.rint(instants * SECOND).astype(np.int64)


def read(true: Array, sigma: float, resolution: float, rng: np.random.Generator) -> Array:
    """Return values with normal noise of `sigma`, rounded to `resolution`; all in one unit, any shape."""
    noisy = true + sigma * rng.standard_normal(true.shape)
    return noisy if resolution == 0.0 else np.asarray(np.rint(noisy / resolution) * resolution)


def specific_force(acceleration: Array, angle: Array, gravity: Array) -> Array:
    """Return the reading of an ideal accelerometer: acceleration minus gravity in its own axes, (m, 2) m/s^2.

    `acceleration` (m, 2), without gravity, and `gravity` (2,) are in the base's axes, `angle` (m,) is that of the x axis
    there, rad.
    """
    fx, fy = acceleration[:, 0] - gravity[0], acceleration[:, 1] - gravity[1]
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * fx + s * fy, -s * fx + c * fy])


@dataclass(frozen=True)
class RigSession:
    """Samples of all sensors, taken at common instants, with the truth at the same instants."""

    stamps: NDArray[np.int64]  # (m,), ns
    strokes: Array  # (m, n), cylinder lengths pin to pin less `closed_length`, m, as transducers read them
    joints: Array  # (m, n), rad
    imu: Array  # (m, 2), specific force at the tip along its x and z, m/s^2
    angle_stamps: NDArray[np.int64]  # (m,), ns; `stamps` unless angles come late
    forces: Array  # (m, n), of the cylinders, positive in tension, N
    truth: dict[str, Array]  # ``t`` (m,), ``strokes`` (lengths), ``drives``, ``joints``, ``forces``, ``tip``, ``load`` .., SI
    placed: dict[Stream, Array] = field(default_factory=dict)  # of sensors that have a place, and the gyro at the tip

    def save_truth(self, path: Path) -> None:
        """Write the truth as a gzipped CSV; equal truths give equal bytes."""
        text = [",".join(name for name, _, _ in self._columns())]
        columns = [[f"{value:.{digits}f}" for value in np.round(values, digits) + 0.0] for _, digits, values in self._columns()]
        text += [",".join(row) for row in zip(*columns, strict=True)]
        content = BytesIO()
        with gzip.GzipFile("", "wb", 9, content, mtime=0) as packed:
            packed.write(("\n".join(text) + "\n").encode())
        write_atomic(path, content.getvalue())

    def _columns(self) -> list[tuple[str, int, Array]]:
        truth, number = self.truth, range(self.strokes.shape[1])
        load = [] if "load" not in truth else [(f"tip_load_{axis}_N", 3, truth["load"][:, i]) for i, axis in enumerate("xy")]
        return [
            ("t_s", 9, truth["t"]),
            ("tip_x_m", 6, truth["tip"][:, 0]),
            ("tip_y_m", 6, truth["tip"][:, 1]),
            ("tip_ax_m_s2", 4, truth["tip_acc"][:, 0]),
            ("tip_ay_m_s2", 4, truth["tip_acc"][:, 1]),
            ("tip_angle_rad", 7, truth["tip_angle"]),
            *((f"length_{i + 1}_m", 7, truth["strokes"][:, i]) for i in number),
            *((f"drive_{i + 1}_m", 7, truth["drives"][:, i]) for i in number),
            *((f"joint_{i + 1}_rad", 7, truth["joints"][:, i]) for i in number),
            *((f"cylinder_force_{i + 1}_N", 1, truth["forces"][:, i]) for i in number),
            *load,
        ]


def observe(
    scene: Scene,
    drive: Drive,
    rows: dict[str, Array],
    sensors: Sensors,
    seed: int,
    load: TipLoad | None = None,
    places: Mapping[str, Place] = NO_PLACES,
    cylinders: Sequence[tuple[float, float]] = (),
) -> RigSession:
    """Sample the motion `rows` that `simulate` gave for a drive and load; stamps depend on the seed alone, not on the noise.

    `places` are those of IMUs beside the one at the tip, strain gauges (``moment_1`` ..) and points, seen once in
    `POINT_PERIOD`. `cylinders` are bore and rod (m) of all whose pressures are measured.
    """
    clock, stroke_noise, angle_noise, imu_noise, force_noise, *others = np.random.default_rng(seed).spawn(7 + len(places))
    stamps = sampling_stamps(sensors, float(rows["t"][-1]), EPOCH, clock)
    times = (stamps - EPOCH) / SECOND

    def at(values: Array) -> Array:
        return np.asarray(CubicSpline(rows["t"], values)(times))

    truth = {name: at(rows[name]) for name in ("tip", "tip_acc", "tip_angle", "joints", "forces")}
    truth |= {"t": times, "strokes": at(rows["lengths"]), "drives": drive(times)[0]}
    if load is not None:
        truth["load"] = load(times)
    force = specific_force(truth["tip_acc"], truth["tip_angle"], gravity_in_base(scene))
    placed = {Stream.RATE: read(at(rows["tip_rate"])[:, None], sensors.rate_sigma, 0.0, others[0])}
    for k, ((name, place), noise) in enumerate(zip(places.items(), others[1:-1], strict=True)):
        site = rows["sites"][:, k]  # x, y, their accelerations, angle, its rate, bending moment
        if name.startswith("moment_"):
            of_all = placed.setdefault(Stream.MOMENTS, np.full(truth["joints"].shape, np.nan))
            of_all[:, int(name.removeprefix("moment_")) - 1] = read(at(site[:, 6]), sensors.moment_sigma, 0.0, noise)
        elif name.startswith("points"):
            position = at(site[:, :2])
            placed[Stream(name)] = np.full(position.shape, np.nan)
            seen = np.unique(np.floor(times / POINT_PERIOD), return_index=True)[1]
            placed[Stream(name)][seen] = read(position[seen], sensors.point_sigma, 0.0, noise)
        else:
            felt = specific_force(at(site[:, 2:4]), at(site[:, 4]) + place.turned, gravity_in_base(scene))
            placed[Stream(name)] = read(felt, sensors.imu_sigma, 0.0, noise)
            placed[Stream(f"{name}_rate")] = read(at(site[:, 5:6]), sensors.rate_sigma, 0.0, noise)
    if cylinders:
        pressures = _pressures(truth["forces"], cylinders)
        placed[Stream.PRESSURES] = read(pressures, sensors.pressure_sigma, 0.0, others[-1])
    return RigSession(
        stamps,
        read(truth["strokes"], sensors.stroke_sigma, sensors.stroke_resolution, stroke_noise),
        read(truth["joints"], sensors.angle_sigma, sensors.angle_resolution, angle_noise),
        read(force, sensors.imu_sigma, 0.0, imu_noise),
        stamps,
        read(truth["forces"], sensors.force_sigma, sensors.force_resolution, force_noise),
        truth,
        placed,
    )


def record(
    scene: Scene,
    drive: Drive,
    duration: float,
    sensors: Sensors | None = None,
    seed: int = 0,
    step: float = 5e-4,
    elements: int = 16,
    load: TipLoad | None = None,
    changes: Sequence[Change] = (),
    places: Mapping[str, Place] = NO_PLACES,
    cylinders: Sequence[tuple[float, float]] = (),
) -> RigSession:
    """Simulate the boom for `duration` (s) under a load, while it changes, and sample it; sensors are at `places`, too."""
    sites = tuple(site_of(scene, place) for place in places.values())
    rows = simulate(scene, drive, duration, step, 2 * step, elements, load, changes, sites)
    return observe(scene, drive, rows, sensors or Sensors(), seed, load, places, cylinders)


def _pressures(forces: Array, cylinders: Sequence[tuple[float, float]]) -> Array:
    """Return pressures (m, 2 n; Pa) of cap and rod side by forces (m, n; N): the side that pulls less has `BACK_PRESSURE`."""
    bore, rod = np.array(cylinders).T
    piston, ring = np.pi / 4 * bore**2, np.pi / 4 * (bore**2 - rod**2)
    cap = np.maximum((BACK_PRESSURE * ring - forces) / piston, BACK_PRESSURE)
    return np.asarray(np.stack([cap, (forces + cap * piston) / ring], axis=2).reshape(len(forces), -1))


def site_of(scene: Scene, place: Place) -> Site:
    section = len(scene.sections) if place.section is None else place.section
    return Site(section - 1, scene.sections[section - 1].length if place.at is None else place.at)
