"""How often the 95 % intervals of a calibration hold the truth: 30 sets of noise on one short motion of the virtual rig.

Run ``python test/bench/calibration_coverage.py [SETS]``: about half an hour on an idle core. 84 % were measured (26 sets, two
sections, 30 s): intervals of short sessions are too narrow, see docs/calibrate.md.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from calibration.sessions import cut_to, made, off

from boom_twin.calibration.forward_model import CalibrationProblem
from boom_twin.calibration.least_squares import fitted
from boom_twin.calibration.noise_model import blocks_of, channel_names
from boom_twin.calibration.sessions import MeasuredSession, Series, course_of
from boom_twin.calibration.unknowns import unknowns_of, usual_names
from boom_twin.config.settings import Settings
from boom_twin.scene.edit import parameter
from boom_twin.types import Stream
from boom_twin.validation import rig

FIRST = 100  # seed
COMPARED = (Stream.ANGLES, Stream.IMU)


def run(sets: int) -> None:
    """Fit every set; print the share of intervals that hold the truth as it grows."""
    scene, settings = cut_to(2), Settings()
    short = made(off(scene, 0.92, 1.1), "arch", 30.0, 4)
    unknowns = unknowns_of(scene, usual_names(scene, tuple(Stream)))
    truth = np.array([0.0 if u.name.endswith(".zero") else parameter(short.truth, u.name) for u in unknowns])
    scale = [u.kind.prior * (at if u.kind.relative else 1.0) for u, at in zip(unknowns, truth, strict=True)]
    scores = []
    for seed in range(FIRST, FIRST + sets):
        seen = rig.observe(short.truth, short.programme, short.rows, rig.Sensors(), seed)
        values = {Stream.STROKES: seen.strokes, Stream.ANGLES: seen.joints, Stream.IMU: seen.imu}
        session = MeasuredSession("made", "", {stream: Series(seen.stamps, rows) for stream, rows in values.items()})
        course = course_of(session, settings)
        blocks = blocks_of(session, course, 0.05, COMPARED, [None, None])
        problem = CalibrationProblem(scene, unknowns, [(course, blocks)], channel_names(2, COMPARED), settings)
        fit = fitted(problem, lambda: None)
        found = np.array([u.value(d) for u, d in zip(unknowns, fit.deviations, strict=True)])
        scores.append((found - truth) / scale / np.sqrt(np.diag(fit.covariance())))
        print(f"{len(scores)} sets: {100 * np.mean(np.abs(scores) < 1.96):.0f} % of {np.size(scores)}", flush=True)


if __name__ == "__main__":
    run(int(sys.argv[1]) if len(sys.argv) > 1 else 30)
