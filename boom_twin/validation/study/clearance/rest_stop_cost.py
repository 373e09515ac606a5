"""What play changes in how the tip swings after a stop: in every posture, against ideal pins."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..analysis.march import March, march
from ..analysis.statics import statics
from ..records import Array
from ..scene.parts import Scene
from .clearance_scenes import ideal, treated
from .halt import Halt, halt

STEP = 1e-3  # s
HOLD, QUICK_HOLD = 15.0, 0.9  # s after the stop
BRAKE = 0.1  # s
SETTLED = 0.5  # of the largest swing after the stop
UNSEEN = 1.0  # s before the end: a swing then may be followed by another
FINEST = 0.01  # Hz, of a spectrum
MODELS = ("ideal", "contact", "spring-damper")


@dataclass(frozen=True)
class Swing:
    """The tip after a stop, in one posture with one kind of pins. m rows.

    Attributes
    ----------
    times, height, acceleration : ndarray, shape (m,)
        s, from the stop (the drives hold from 0); height over the rest at the end with ideal pins, m; vertical, m/s^2.
    rest : float
        Height at rest at the end, m, likewise.
    peak, rms : float
        Largest distance from that rest after the stop, and its root mean square, m.
    top, effective : float
        Vertical acceleration after the stop: largest, root mean square, m/s^2.
    settling : float
        After it the tip stays within `SETTLED` of `peak`, s; infinite if that is not seen.
    frequency : float
        Of the largest line in the spectrum of the height, Hz.
    doubt : str
    lost : int
        Rows at which any pin has just lost contact.
    """

    posture: str
    model: str
    times: Array
    height: Array
    acceleration: Array
    rest: float
    peak: float
    rms: float
    top: float
    effective: float
    settling: float
    frequency: float
    doubt: str
    lost: int


def swings(scene: Scene, postures: tuple[str, ...], hold: float = HOLD) -> list[Swing]:
    """Every posture with ideal pins, contact and linearised pins."""
    found = []
    for posture in postures:
        drive = halt(scene, posture, BRAKE)
        scenes = (ideal(scene), treated(scene, "contact"), treated(scene, "spring-damper"))
        reference = _rest_of(scenes[0], drive)
        for model, one in zip(MODELS, scenes, strict=True):
            moved = march(one, drive, drive.still + hold, STEP, angles=drive.angles)
            # a linearised pin belongs to the rest at the start; at the end contact says where it lies
            rest = _rest_of(scenes[1] if model != "ideal" else one, drive)
            found.append(_swing(posture, model, moved, drive, rest - reference, reference))
    return found


def _rest_of(scene: Scene, drive: Halt) -> float:
    """Height (m) of the tip at rest where the drives have stopped."""
    return float(statics(scene, strokes=drive.last, modes=0).tip[1])


def _swing(posture: str, model: str, moved: March, drive: Halt, rest: float, reference: float) -> Swing:
    times, height, acceleration = moved.times - drive.still, moved.tip[:, 1] - reference, moved.tip_acceleration[:, 1]
    after = times >= -1e-9
    off = height[after] - (rest if model != "spring-damper" else float(np.mean(height[after])))
    peak = float(np.abs(off).max())
    wide = np.flatnonzero(np.abs(off) > SETTLED * peak)
    settling = float(times[after][wide[-1]]) if times[-1] - times[after][wide[-1]] > UNSEEN else math.inf
    lost = int(np.sum(np.diff(moved.pins[:, :, 3], axis=0) < 0.0)) if moved.pins.shape[1] else 0
    return Swing(
        posture, model, times, height, acceleration, rest, peak, float(np.sqrt(np.mean(off**2))),
        float(np.abs(acceleration[after]).max()), float(np.sqrt(np.mean(acceleration[after] ** 2))),
        settling, main_frequency(off, STEP), moved.doubt or moved.status.replace("ok", ""), lost,
    )  # fmt: skip


def main_frequency(values: Array, step: float) -> float:
    """Frequency (Hz) of the largest line of `values` (m,), `step` s apart."""
    count = max(len(values), round(1.0 / (FINEST * step)))
    spectrum = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(len(values)), count))
    return float(np.argmax(spectrum) / (count * step))
