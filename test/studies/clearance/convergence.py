"""Convergence of motions with clearance towards steps of 1 us, beside a SciPy reference.

The study's four pins on the elastic boom, and one pin on the rigid boom whose other cylinders are incompressible: that is the
boom part which `reference.worn_pin` moves with equations and contact of its own.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from reference.worn_pin.geometry import cylinder_length
from reference.worn_pin.motion import PinMotion, PinnedBoom, freed
from studies.stops import StopMotion, halt

from boom_twin import Scene
from boom_twin.analysis.methods import MethodRun, integrate_with
from boom_twin.scene.schema import Cylinder, Joint
from boom_twin.validation.contact_law import HYSTERESIS, Contact, stiffness

from .scenes import pin_like, pins_of, treated, with_pins, without_friction

STEPS = (2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6)  # s
QUICK_STEPS = (2e-3, 1e-3, 5e-4)  # s
FINEST, QUICK_FINEST = 1e-6, 1e-4  # s
TOLERANCES, QUICK_TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7), (1e-4,)
TIGHTEST, QUICK_TIGHTEST = 1e-9, 1e-6
ROW = 2e-3  # s, between rows that are compared
SPAN = 0.2  # s, from the beginning of the braking, which the start of the motion is moved close to
RAMP, STOP, BRAKE = 0.1, 0.15, 0.01  # s
SMOOTH = 1e-6  # m, as the contact of boom_twin has it
MEASURES = ("tip, mm", "acceleration of the tip, %", "force of the pin, %")


@dataclass(frozen=True)
class MotionRows:
    """m rows: tip (m), its acceleration (m/s^2), contact forces (N)."""

    tip: np.ndarray
    acceleration: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class ErrorCurve:
    """One program on one boom, coarse to fine."""

    case: str  # "one pin, rigid boom" or "all rods' pins, elastic boom"
    program: str  # "boom_twin" or "SciPy"
    against: str  # the reference: "own" or "independent"
    marks: tuple[float, ...]  # steps (s), or tolerances of SciPy
    errors: np.ndarray  # (k, 3), see `MEASURES`: rms over the rows, shares of the quantity's own rms
    seconds: tuple[float, ...]  # run time, for `span` seconds


@dataclass(frozen=True)
class Convergence:
    """All lines, and how long the motions last (s)."""

    lines: tuple[ErrorCurve, ...]
    span: float


def convergence(scene: Scene, quick: bool = False) -> Convergence:
    """Both booms; without the independent model if no cylinder has k, barrel and rod."""
    span, steps = STOP + SPAN, QUICK_STEPS if quick else STEPS
    finest = QUICK_FINEST if quick else FINEST
    full = treated(scene, "contact")
    lines = [_own("all rods' pins, elastic boom", full, _stopped(full, None), span, steps, finest)[0]]
    index = _free(scene)
    if index is None:
        return Convergence(tuple(lines), span)
    one = one_pin(full, index)
    drive = _stopped(one, index)
    line, tracks = _own("one pin, rigid boom", one, drive, span, steps, finest)
    tolerances = QUICK_TOLERANCES if quick else TOLERANCES
    independent = peer(one, index, drive, span, QUICK_TIGHTEST if quick else TIGHTEST)[0]
    runs = [peer(one, index, drive, span, tolerance) for tolerance in tolerances]
    lines += [
        ErrorCurve(line.case, "boom_twin", "independent", steps, errors(tracks, independent), line.seconds),
        ErrorCurve(
            line.case, "SciPy", "independent", tolerances, errors([track for track, _ in runs], independent),
            tuple(seconds for _, seconds in runs),
        ),
    ]  # fmt: skip
    return Convergence(tuple(lines), span)


def _stopped(scene: Scene, only: int | None) -> StopMotion:
    drive = halt(scene, None, BRAKE, only)
    return StopMotion(drive.angles, drive.first, drive.speed, BRAKE, RAMP, STOP)


def _own(
    case: str, scene: Scene, drive: StopMotion, span: float, steps: tuple[float, ...], finest: float
) -> tuple[ErrorCurve, list[MotionRows]]:
    runs = [_fastest(scene, drive, span, step) for step in (*steps, finest)]
    tracks = [_track(run) for run in runs]
    found = errors(tracks[:-1], tracks[-1])
    return ErrorCurve(case, "boom_twin", "own", steps, found, tuple(run.seconds for run in runs[:-1])), tracks[:-1]


def _fastest(scene: Scene, drive: StopMotion, span: float, step: float) -> MethodRun:
    """The fastest of three runs; of short steps just one."""
    runs = [
        integrate_with(scene, drive, span, step, round(ROW / step), angles=drive.angles)
        for _ in range(3 if step >= 1e-4 else 1)
    ]
    return min(runs, key=lambda run: run.seconds)


def _track(run: MethodRun) -> MotionRows:
    return MotionRows(run.tip, run.tip_acceleration, run.pins[:, :, 2])


def errors(tracks: Sequence[MotionRows], right: MotionRows) -> np.ndarray:
    """`MEASURES` of every track, shape (k, 3)."""

    def off(track: MotionRows) -> list[float]:
        return [
            1e3 * _rms(track.tip - right.tip),
            100.0 * _rms(track.acceleration - right.acceleration) / _rms(right.acceleration),
            100.0 * _rms(track.force - right.force) / _rms(right.force),
        ]

    return np.array([off(track) for track in tracks])


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _free(scene: Scene) -> int | None:
    """The first cylinder (from 0) that the independent model can move."""
    cylinders = [joint.cylinder for joint in scene.joints]
    return next((i for i, part in enumerate(cylinders) if part.k and part.barrel and part.rod), None)


def one_pin(scene: Scene, index: int) -> Scene:
    """The rigid boom with play, without friction, in the rod of cylinder `index` (from 0); the others are incompressible."""
    sections = tuple(section.model_copy(update={"modes": 0}) for section in scene.sections)
    joints = tuple(joint if i == index else _hard(joint) for i, joint in enumerate(scene.joints))
    bare = scene.model_copy(update={"sections": sections, "joints": joints})
    return with_pins(without_friction(bare), [pin_like(scene, f"cylinder_{index + 1}.rod")])


def _hard(joint: Joint) -> Joint:
    cylinder: Cylinder = joint.cylinder.model_copy(update={"k": None, "oil": None, "d": None})
    return joint.model_copy(update={"cylinder": cylinder})


def peer(scene: Scene, index: int, drive: StopMotion, span: float, tolerance: float) -> tuple[MotionRows, float]:
    """The motion by the independent model, and its run time (s)."""
    headings, document = np.cumsum(drive.angles), scene.model_dump(exclude_none=True)
    boom: PinnedBoom = freed(document, headings.tolist(), index, _contact(scene))
    closed = scene.joints[index].cylinder.closed_length

    def length(now: float) -> tuple[float, float]:
        strokes, rates = drive(np.array([now]))
        return closed + float(strokes[0, index]), float(rates[0, index])

    rest = boom.rest(cylinder_length(document, headings, index), float(headings[index]))
    times = np.asarray(ROW * np.arange(round(span / ROW) + 1), float)
    begun = time.perf_counter()
    found: PinMotion = boom.follow(length, rest, times, (drive.ramp, drive.stop, drive.still), tolerance)
    seconds = time.perf_counter() - begun
    return MotionRows(found.tip, found.acceleration, np.hypot(*found.force.T)[:, None]), seconds


def _contact(scene: Scene) -> Contact:
    """The one pin's, by the formulas of the independent model."""
    block, material = pins_of(scene), scene.material
    pin, law = block.pins[0], block.contact
    k = stiffness(pin.pin_radius, pin.radial_clearance, material.E, material.nu)
    return Contact(k, HYSTERESIS[law.law](law.restitution), pin.radial_clearance, law.exponent, SMOOTH)
