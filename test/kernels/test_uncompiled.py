"""The kernels as plain Python, and compiled with bounds checks, give what the compiled ones give; with clearance too."""

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
from boom_twin import simulate
from boom_twin import statics
from boom_twin import load_scene
from boom_twin.scene.schema import Clearance, ContactLaw, Pin
scene, count, pins = load_scene(), int(sys.argv[1]), sys.argv[2:]
if pins:
    worn = [Pin(at=at, pin_radius=0.025, radial_clearance=1e-4) for at in pins]
    scene = scene.model_copy(update={"clearance": Clearance(contact=ContactLaw(friction=0.1), pins=worn)})
found = statics(scene, posture="arch", modes=1)
times = 2e-3 * np.arange(count + 1)
strokes = found.strokes + np.outer(times**2, [8.0, -4.0, 6.0, 4.0])
moved = simulate(scene, times, strokes, dt=2e-3)
rows = [found.tip, found.joints, found.cylinder_forces, found.frequencies]
rows += [moved.tip[-1], moved.tip_velocity[-1], moved.tip_acceleration[-1], moved.cylinder_forces[-1], moved.pins[-1].ravel()]
json.dump([float(x) for row in rows for x in row], sys.stdout)
"""
WORN = ("cylinder_1.rod", "joint_1.pivot", "cylinder_3.barrel", *(f"joint_3.{at}" for at in ("pivot", "link_L", "link_R", "Q")))
RUNS = {"ideal": ("20",), "worn": ("4", *WORN)}  # steps and pins with clearance


def numbers(words, **variables):
    environment = os.environ | variables
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words], env=environment, capture_output=True, text=True, check=False, timeout=1000
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return np.array(json.loads(done.stdout))


def agree(found, expected):
    """Statics to rounding; accelerations carry the rounding of positions times 1/(beta h^2), about 1e6."""
    assert found[:11] == pytest.approx(expected[:11], rel=1e-10)
    assert found[11:] == pytest.approx(expected[11:], rel=1e-7)


@pytest.fixture(scope="module", params=RUNS)
def compiled(request):
    """What to run, and the numbers."""
    return RUNS[request.param], numbers(RUNS[request.param])


def test_uncompiled_kernels_agree(compiled):
    words, expected = compiled
    agree(numbers(words, NUMBA_DISABLE_JIT="1"), expected)


@pytest.fixture(scope="module")
def bounds_checked(tmp_path_factory):
    """Where the kernels are kept that are compiled once more (a minute)."""
    return str(tmp_path_factory.mktemp("bounds_checked"))


@pytest.mark.slow
def test_bounds_checked_kernels_agree(compiled, bounds_checked):
    """No kernel reads or writes outside its arrays."""
    words, expected = compiled
    agree(numbers(words, NUMBA_BOUNDSCHECK="1", NUMBA_CACHE_DIR=bounds_checked), expected)
