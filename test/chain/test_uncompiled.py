"""The kernels as plain Python, and compiled with bounds checks, give what the compiled ones give."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest

PROGRAM = """
import json, sys
import numpy as np
from boom_twin.analysis.simulate import simulate
from boom_twin.analysis.statics import statics
from boom_twin.scene import load_scene
scene = load_scene()
found = statics(scene, posture="arch", modes=1)
times = 2e-3 * np.arange(21)
strokes = found.strokes + np.outer(times**2, [8.0, -4.0, 6.0, 4.0])
moved = simulate(scene, times, strokes, dt=2e-3)
rows = [found.tip, found.joints, found.cylinder_forces, found.frequencies]
rows += [moved.tip[-1], moved.tip_velocity[-1], moved.tip_acceleration[-1], moved.cylinder_forces[-1]]
json.dump([float(x) for row in rows for x in row], sys.stdout)
"""


def numbers(**variables):
    environment = os.environ | variables
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=False, timeout=500
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return np.array(json.loads(done.stdout))


def agree(found, expected):
    """Statics to rounding; accelerations carry the rounding of positions times 1/(beta h^2), about 1e6."""
    assert found[:11] == pytest.approx(expected[:11], rel=1e-10)
    assert found[11:] == pytest.approx(expected[11:], rel=1e-7)


@pytest.fixture(scope="module")
def compiled():
    return numbers()


def test_uncompiled_kernels_agree(compiled):
    agree(numbers(NUMBA_DISABLE_JIT="1"), compiled)


@pytest.mark.slow
def test_bounds_checked_kernels_agree(compiled, tmp_path):
    """No kernel reads or writes outside its arrays; compiles everything once more (a minute)."""
    agree(numbers(NUMBA_BOUNDSCHECK="1", NUMBA_CACHE_DIR=str(tmp_path)), compiled)
