"""The element adds its force to statics and its stiffness to vibration, both in closed form; a stiff one holds the tip."""

import math
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from boom_twin import BoomTwinError, Scene, load_scene, statics
from boom_twin.compiler.compile import compile_scene
from boom_twin.scene.load import default_text
from boom_twin.scene.schema import Support, Tip
from boom_twin.scene.summary import left_out

LENGTH, MASS, COM, INERTIA, ANGLE, K = 3.0, 200.0, (1.4, 0.0), 150.0, 0.4, 2.0e4


def lever(support=None, oil=None):
    """A rigid section on cylinder 1, which is massless, at the angle `ANGLE`."""
    spec = YAML(typ="safe").load(default_text())
    root = {"mass": MASS, "com": list(COM), "inertia": INERTIA}
    joint = spec["joints"][0]
    joint["cylinder"] = {key: joint["cylinder"][key] for key in ("closed_length", "max_stroke")} | ({"k": oil} if oil else {})
    spec["sections"] = [{"length": LENGTH, "root": root, "rod_pin": spec["sections"][0]["rod_pin"]}]
    spec |= {"joints": [joint], "tip": {"support": support} if support else {}, "postures": {"test": [math.degrees(ANGLE)]}}
    return Scene.model_validate(spec)


def cylinder_length(scene, angle):
    """From pin to pin, m."""
    (x, y), (px, py), (cx, cy) = scene.sections[0].rod_pin, scene.base.pivot, scene.base.cylinder_pin
    c, s = math.cos(angle), math.sin(angle)
    return math.hypot(px + c * x - s * y - cx, py + s * x + c * y - cy)


free = lever()
slope = (cylinder_length(free, ANGLE + 1e-6) - cylinder_length(free, ANGLE - 1e-6)) / 2e-6
tip = np.array(free.base.pivot) + LENGTH * np.array([math.cos(ANGLE), math.sin(ANGLE)])
across = LENGTH * np.array([-math.sin(ANGLE), math.cos(ANGLE)])  # of the tip by the angle

# Rigid: the cylinder bears what the support adds to the moment about the pivot, k (r - a).dr/dangle = -dN dl/dangle.
at = tip + np.array([0.05, -0.2])
forces = [statics(scene, posture="test").cylinder_forces[0] for scene in (free, lever({"k": K, "at": at.tolist()}))]
assert math.isclose(forces[1] - forces[0], -K * (tip - at) @ across / slope, rel_tol=1e-6)

# On an oil spring: at the place where the tip rests the support bears nothing, and stiffens the one vibration by k L^2/J.
found = statics(lever(oil=5e7), posture="test")
stiffer = statics(lever({"k": K, "at": found.tip.tolist()}, oil=5e7), posture="test")
assert np.allclose(stiffer.tip, found.tip, atol=1e-9)
squares = [(2.0 * math.pi * each.frequencies[0]) ** 2 for each in (found, stiffer)]
assert math.isclose(squares[1] - squares[0], K * LENGTH**2 / (INERTIA + MASS * COM[0] ** 2), rel_tol=1e-3)

# Absent is empty, and the default boom, which is flexible, is held by an immovable support.
assert len(compile_scene(free).tables.supports) == 0
default = load_scene()
place = statics(default, posture="arch", modes=1).tip + np.array([0.0, 0.01])
held = default.model_copy(update={"tip": Tip(support=Support(k=1e12, at=place.tolist()))})
assert np.abs(statics(held, posture="arch", modes=1).tip - place).max() < 1e-6
assert "tip.support" not in left_out(held) and "tip.support" in left_out(default)

# A wrong key is told with the nearest one, a wrong value with its meaning.
for block, words in (("{suport: {}}", "`support`"), ("{support: {k: -1.0, at: [0.0, 0.0]}}", "the stiffness, N/m")):
    Path("scene.yaml").write_text(f"{default_text()}\ntip: {block}\n")
    try:
        load_scene("scene.yaml")
    except BoomTwinError as error:
        assert words in str(error), error
    else:
        raise AssertionError(block)
