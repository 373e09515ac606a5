"""The papers' four postures: a stop with ideal and with worn rod pins, beside the independent multibody code."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from studies.clearance.scenes import ideal, treated, with_play, without_friction
from studies.stops import StopMotion, halt

from boom_twin import Scene
from boom_twin.analysis.methods import MethodRun, integrate_with

RAMP, STOP, BRAKE = 0.3, 0.6, 0.05  # s
STEP, ROW = 1e-3, 2e-3  # s, of this model; of all rows
PEER_STEPS = {"ideal": 1e-3, "worn": 2e-4}  # s
ELEMENTS = 8
NEAR = 4e-6  # m, of the gap, from which on a journal flies


@dataclass(frozen=True)
class PostureRun:
    """A stop in one posture by one program. m rows, n cylinders, k pins with clearance."""

    posture: str
    pins: str  # "ideal" or "worn"
    times: np.ndarray  # (m,), s
    tip: np.ndarray  # (m, 2), m
    acceleration: np.ndarray  # (m, 2), m/s^2
    forces: np.ndarray  # (m, n), N, of the cylinders
    penetration: np.ndarray  # (m, k), m, of the journals; negative in flight


@dataclass(frozen=True)
class Comparison:
    """Both programs, and how far they are apart. Differences are rms, up to the first flight of a journal."""

    own: PostureRun
    peer: PostureRun
    flight: float  # s, when a journal first left its bush; the end where none did
    tip: float  # m
    tip_throughout: float  # m, to the end, whatever flies
    forces: float  # share of their rms
    acceleration: float  # share of its rms
    penetration: float  # largest difference as a share of the largest penetration; NaN for ideal pins


def stop_in(scene: Scene, posture: str) -> StopMotion:
    """Full speed, then a stop within `BRAKE`."""
    own = halt(scene, posture, BRAKE)
    return StopMotion(own.angles, own.first, own.speed, BRAKE, RAMP, STOP)


def worn(scene: Scene) -> Scene:
    """`scene` with contact in all rod pins, without friction."""
    return without_friction(treated(with_play(scene), "contact"))


def run_own(scene: Scene, posture: str, pins: str, span: float) -> PostureRun:
    """Run one posture by this model."""
    drive, one = stop_in(scene, posture), worn(scene) if pins == "worn" else ideal(scene)
    found: MethodRun = integrate_with(one, drive, span, STEP, round(ROW / STEP), angles=drive.angles)
    gaps = np.array([pin.radial_clearance for pin in one.clearance.pins]) if one.clearance else np.zeros(0)
    depth = np.hypot(found.pins[:, :, 0], found.pins[:, :, 1]) - gaps
    return PostureRun(posture, pins, found.times, found.tip, found.tip_acceleration, found.cylinder_forces, depth)


def run_peer(scene: Scene, posture: str, pins: str, span: float, step: float) -> PostureRun:
    """Run one posture by Exudyn: geometrically exact beams, contact by user functions."""
    from boom_twin.validation.rig.exudyn.solve import at_rest, move

    drive, one = stop_in(scene, posture), worn(scene) if pins == "worn" else ideal(scene)
    resting = at_rest(one, drive.first, ELEMENTS, nodally_exact=True)
    found, _ = move(resting, drive, span, step, ROW)
    gaps = [pin.radial_clearance for pin in one.clearance.pins] if one.clearance else []
    offsets = [np.hypot(found[f"cylinder_{i + 1}_rod_dx_m"], found[f"cylinder_{i + 1}_rod_dy_m"]) for i in range(len(gaps))]
    return PostureRun(
        posture,
        pins,
        found["t_s"],
        np.column_stack([found["tip_x_m"], found["tip_y_m"]]),
        np.column_stack([found["tip_ax_m_s2"], found["tip_ay_m_s2"]]),
        np.column_stack([found[f"cylinder_force_{i + 1}_N"] for i in range(len(scene.joints))]),
        np.array([offset - gap for offset, gap in zip(offsets, gaps, strict=True)]).reshape(len(gaps), -1).T
        if gaps
        else np.zeros((len(found["t_s"]), 0)),
    )


def compare(own: PostureRun, peer: PostureRun) -> Comparison:
    """Compare two programs, up to the first flight of a journal in either."""
    flying = np.flatnonzero(((own.penetration < -NEAR) | (peer.penetration < -NEAR)).any(axis=1))
    until = int(flying[0]) if len(flying) else len(own.times)
    apart = np.linalg.norm(own.tip - peer.tip, axis=1)
    deepest, both = own.penetration[:until], peer.penetration[:until]
    return Comparison(
        own,
        peer,
        float(own.times[until - 1]),
        _rms(apart[:until]),
        _rms(apart),
        _rms((own.forces - peer.forces)[:until]) / _rms(peer.forces[:until]),
        _rms((own.acceleration - peer.acceleration)[:until]) / _rms(peer.acceleration[:until]),
        float(np.abs(deepest - both).max() / both.max()) if deepest.size else float("nan"),
    )


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
