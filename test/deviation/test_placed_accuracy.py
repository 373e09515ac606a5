"""The accuracy that is stated for further sensors is what they come to on a boom of the independent model."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.linalg import cholesky, expm

pytest.importorskip("exudyn")

from default_boom import EXACT, strokes_of_posture

from boom_twin import Sample, Stream, Twin, load_scene
from boom_twin.deviation.accuracy import accuracy_at
from boom_twin.scene.summary import weight_of
from boom_twin.types import Array, Place
from boom_twin.validation.rig import RigSession, record

pytestmark = pytest.mark.slow

SCENE = load_scene()
ARCH = strokes_of_posture(SCENE, "arch")
PLACES = {"imu_2": Place(2, 1.65, np.radians(30.0)), "moment_2": Place(2, 1.5), "points": Place()}
SPAN, SETTLED, STEP, TIME = 45.0, 15.0, 0.005, 0.1  # s; the last: time constant of the load
USUAL = Stream.ANGLES, Stream.IMU


@pytest.fixture(scope="module")
def session() -> RigSession:
    """A boom at rest under a smooth random load of the size that `accuracy_at` assumes."""
    size, rng = 2.5e-3 * weight_of(SCENE), np.random.default_rng(5)
    step = expm(STEP * np.array([[0.0, 1.0], [-1.0 / TIME**2, -2.0 / TIME]]))
    stationary = np.diag([size**2, (size / TIME) ** 2])
    spread = cholesky(stationary - step @ stationary @ step.T, lower=True)
    state, times = np.zeros((2, 2)), STEP * np.arange(round(SPAN / STEP) + 400)
    loads = np.array([(state := step @ state + spread @ rng.standard_normal((2, 2)))[0] for _ in times])
    load = CubicSpline(times, loads * np.clip(2.0 * times, 0.0, 1.0)[:, None])

    def rest(times: Array) -> tuple[Array, Array]:
        return np.tile(ARCH, (len(times), 1)), np.zeros((len(times), 4))

    return record(SCENE, rest, SPAN, seed=3, load=load, places=PLACES)


@pytest.mark.parametrize(
    "streams",
    [USUAL, (Stream.IMU_2,), (Stream.IMU_2, Stream.RATE_2), (Stream.MOMENTS,), (*USUAL, Stream.POINT),
     (*USUAL, Stream.IMU_2, Stream.RATE_2, Stream.MOMENTS, Stream.POINT)],
    ids=lambda streams: "+".join(stream.value for stream in streams),
)  # fmt: skip
def test_the_error_of_the_tip_is_as_forecast(session: RigSession, streams: tuple[Stream, ...]) -> None:
    readings = {Stream.ANGLES: session.joints, Stream.IMU: session.imu, **session.placed}
    twin, tips = Twin(SCENE, places=PLACES), []
    for i, stamp in enumerate(session.stamps.tolist()):
        report = twin.update(Sample(Stream.STROKES, stamp, session.strokes[i]))
        assert report.estimate is not None
        tips.append(report.estimate.tip[:2])
        for stream in streams:
            if np.isfinite(readings[stream][i]).any():
                twin.update(Sample(stream, stamp, readings[stream][i]))
    error = (np.array(tips) - session.truth["tip"])[session.truth["t"] > SETTLED]
    stated = accuracy_at(SCENE, ARCH, streams, EXACT, places=PLACES).tip[:2]
    assert np.sqrt((error**2).sum(axis=1).mean()) == pytest.approx(np.hypot(*stated), rel=0.25)
