"""Seeded booms unlike the default scene: 1 to 5 sections, any joints, pins anywhere, parts missing. All made up."""

from __future__ import annotations

from copy import deepcopy
from functools import cache

import numpy as np
from default_boom import default_text
from reference.segments.boom import Segments
from reference.segments.geometry import link_headings
from ruamel.yaml import YAML

from boom_twin import Scene

LEAST_LEVER = 0.08  # m/rad, of every cylinder at the posture
BARREL_PINS = ("root", "beam", "head", "given")


def document():
    """The default scene as plain dicts, to be changed at will."""
    return deepcopy(_default())


@cache
def _default():
    return YAML(typ="safe").load(default_text())


def scene_of(spec):
    """A `Scene` from plain dicts."""
    return Scene.model_validate(spec)


def short_boom(sections):
    """The first sections of the default boom, with postures cut to them: quick to study."""
    spec = document()
    spec["sections"], spec["joints"] = spec["sections"][:sections], spec["joints"][:sections]
    spec["postures"] = {name: angles[:sections] for name, angles in spec["postures"].items() if name in ("arch", "low")}
    return scene_of(spec)


def one_rigid(**cylinder):
    """One rigid section of 40 kg on a massless, undamped cylinder, to which `cylinder` adds keys."""
    section = {"length": 3.0, "root": {"mass": 40.0, "com": [1.4, 0.1], "inertia": 30.0}, "rod_pin": [0.60, -0.12]}
    joint = {"kind": "A", "range_deg": [-5, 85], "cylinder": {"closed_length": 1.08, "max_stroke": 0.79, **cylinder}}
    return document() | {"sections": [section], "joints": [joint], "postures": {"up": [40]}}


def undamped():
    """The default scene as plain dicts, without any damping."""
    spec = document()
    for section, joint in zip(spec["sections"], spec["joints"], strict=True):
        section.pop("beta", None)
        joint["cylinder"].pop("d", None)
    return spec


def on_elastic_base(scene, stiffness=5.0e6, damping=None):
    """The boom on a base with an elastic hinge, N m/rad and N m s/rad."""
    return scene.model_copy(update={"base": scene.base.model_copy(update={"stiffness": stiffness, "damping": damping})})


def random_boom(seed):
    """Scene with a posture "test"; what it holds follows from the seed."""
    rng = np.random.default_rng(seed)
    spec = document()
    count = 1 + seed % 5
    sections = [varied_section(spec["sections"][i], rng) for i in rng.integers(0, 4, count)]
    for section in sections:
        section.pop("rod_pin", None)
    sections[0]["rod_pin"] = [[0.5, -0.12], [1.1, -0.2], [0.6, -0.12]][rng.integers(3)]
    joints = [varied_joint(spec["joints"][0], rng)]
    joints += [varied_joint(spec["joints"][i], rng) for i in rng.integers(1, 4, count - 1)]
    for joint, before in zip(joints[1:], sections, strict=False):
        _place_barrel_pin(joint, before, rng)
    vary_cylinders(joints, seed)
    spec |= {"sections": sections, "joints": joints}
    spec["base"] |= {"pivot": [0.3, 0.8], "cylinder_pin": [0.75, -0.45], "inclination": float(rng.uniform(-0.2, 0.2))}
    spec["modes"] = int(rng.integers(2, 5))
    if rng.random() < 0.5:
        spec["tip"] = {"payload": float(rng.uniform(10.0, 80.0))}
    if rng.random() < 0.5:
        spec["line_fill"] = float(rng.uniform(3.0, 15.0))
    return _with_posture(spec, rng)


def milder_boom(seed):
    """One to five sections made of the default scene's parts, some of them heavier, softer, rigid or missing."""
    rng = np.random.default_rng(seed)
    spec = document()
    sections, joints, count = spec["sections"], spec["joints"], 1 + seed % 5
    milder = {"spread": (0.7, 1.5), "missing": 0.2, "rigid": MILDER_RIGID, "in_place_of_a_root": True}
    chosen = [varied_section(sections[i], rng, **milder) for i in np.sort(rng.integers(0, 4, count))]
    for section in chosen:
        section.pop("rod_pin", None)
    chosen[0]["rod_pin"] = [0.60, -0.12]
    mounted = [varied_joint(joints[0], rng, (0.6, 1.5), 0.2)]
    mounted += [varied_joint(joints[i], rng, (0.6, 1.5), 0.2) for i in rng.integers(1, 4, count - 1)]
    vary_cylinders(mounted, seed)
    spec |= {"sections": chosen, "joints": mounted, "postures": {}}
    spec["base"] = spec["base"] | {"inclination": float(rng.uniform(-0.1, 0.1))}
    if rng.random() < 0.5:
        spec["tip"] = {"payload": float(rng.uniform(5.0, 60.0))}
    if rng.random() < 0.5:
        spec["line_fill"] = float(rng.uniform(2.0, 12.0))
    return scene_of(spec)


RIGID = {"mass": 140.0, "com": [1.5, 0.05], "inertia": 110.0}
MILDER_RIGID = {"mass": 150.0, "com": [1.5, 0.03], "inertia": 120.0}


def varied_section(section, rng, spread=(0.5, 2.0), missing=0.25, rigid=RIGID, in_place_of_a_root=False):
    """A copy with other stiffness and mass, perhaps rigid, perhaps without some part."""
    section = dict(section)
    section["I"] *= float(rng.uniform(*spread))
    section["rho_A"] *= float(rng.uniform(*spread))
    for part in ("root", "head", "rho_I", "beta"):
        if rng.random() < missing:
            del section[part]
    kind = rng.random()
    if kind < 0.15:
        section["modes"] = 0
    elif kind < 0.3 and ("root" in section or not in_place_of_a_root):
        for part in ("beam", "head", "A", "I", "rho_A", "rho_I", "beta"):
            section.pop(part, None)
        section["root"] = dict(rigid)
    return section


def varied_joint(joint, rng, spread=(0.5, 2.0), missing=0.25):
    """A copy with another oil spring, perhaps incompressible, perhaps with massless parts."""
    joint = dict(joint, cylinder=dict(joint["cylinder"]))
    joint["cylinder"]["k"] *= float(rng.uniform(*spread))
    for part in ("barrel", "rod", "d"):
        if rng.random() < missing:
            del joint["cylinder"][part]
    if rng.random() < 0.2:
        joint["cylinder"].pop("k")
        joint["cylinder"].pop("d", None)
    for part in ("mL", "mR"):
        if rng.random() < 0.3:
            joint.pop(part, None)
    return joint


def vary_cylinders(joints, seed):
    """Turn some six-bars over to the other side, and give some cylinders oil instead of k; drawn apart from all else."""
    rng = np.random.default_rng([seed, 1])
    for joint in joints:
        if joint["kind"] != "A" and rng.random() < 0.4:
            turn_over(joint)
        if "k" in joint["cylinder"] and rng.random() < 0.4:
            bore = float(rng.uniform(0.06, 0.12))
            lines = {name: float(rng.uniform(3e-4, 2e-3)) for name in ("cap_line", "rod_line")}
            del joint["cylinder"]["k"]
            rod, modulus = bore * float(rng.uniform(0.5, 0.75)), float(rng.uniform(0.8e9, 1.7e9))
            joint["cylinder"]["oil"] = {"bore": bore, "rod": rod, "bulk_modulus": modulus, **lines}


def turn_over(joint):
    """Reflect a joint in the axis of the section before: what was above it is below, and angles turn the other way."""
    joint["range_deg"] = [-joint["range_deg"][1], -joint["range_deg"][0]]
    if joint["kind"] != "A":
        joint["side"] = "left" if joint.get("side") == "right" else "right"
    for key in ("C", "D", "E", "R"):
        if key in joint:
            joint[key] = [joint[key][0], -joint[key][1]]


def mirrored(spec):
    """The boom reflected in the base's x axis, with its gravity."""
    spec = deepcopy(spec)
    for owner, keys in ((spec, ("gravity",)), (spec["base"], ("pivot", "cylinder_pin")), (spec["sections"][0], ("rod_pin",))):
        for key in keys:
            owner[key] = [owner[key][0], -owner[key][1]]
    spec["base"]["inclination"] = -spec["base"].get("inclination", 0.0)
    for section in spec["sections"]:
        for part in ("root", "head"):
            if part in section:
                section[part]["com"] = [section[part]["com"][0], -section[part]["com"][1]]
    for joint in spec["joints"]:
        turn_over(joint)
    spec["postures"] = {name: [-angle for angle in angles] for name, angles in spec["postures"].items()}
    return spec


def _place_barrel_pin(joint, before, rng):
    """Put C on the rigid root, the flexible part or the rigid head of the section before."""
    place = BARREL_PINS[rng.integers(4)]
    if place == "root":
        joint["C"] = [0.1 - before["length"], 0.2]
    elif place == "beam":
        joint["C"] = [-float(rng.uniform(0.4, 0.9)) * before["length"], 0.15]
    elif place == "head":
        joint["C"] = [-0.22, 0.55]


def _with_posture(spec, rng):
    """Choose joint angles well away from dead centres, and cylinders that reach them."""
    relative = []
    for i, joint in enumerate(spec["joints"]):
        low, high = np.radians(joint["range_deg"])
        for _ in range(200):
            angle = rng.uniform(low + 0.1, high - 0.1)
            if lever(spec, i, angle) > LEAST_LEVER:
                break
        relative.append(angle)
    headings = np.degrees(np.cumsum(relative))
    spec["postures"] = {"test": [float(a) for a in headings]}
    model = Segments(scene_of(spec), 0)
    for joint, length in zip(spec["joints"], model.lengths(np.array(relative)), strict=True):
        joint["cylinder"] |= {"closed_length": float(length) - 0.15, "max_stroke": 0.3}
    return scene_of(spec)


def lever(spec, index, angle, size=1e-5):
    """Size of the derivative of a cylinder's length by its joint's angle, m/rad; 0 where the links do not close."""
    joint = spec["joints"][index]
    if joint["kind"] == "A":
        pin = complex(*np.subtract(spec["base"]["cylinder_pin"], spec["base"]["pivot"]))
        rod = complex(*spec["sections"][0]["rod_pin"])
        return abs(np.diff([abs(rod * np.exp(1j * a) - pin) for a in (angle - size, angle + size)])[0]) / (2 * size)
    part = scene_of(spec).joints[index]
    try:
        return abs(np.diff([_six_bar_length(part, a) for a in (angle - size, angle + size)])[0]) / (2 * size)
    except ValueError:
        return 0.0


def _six_bar_length(joint, angle):
    left, right = link_headings(joint, angle)
    d = complex(*joint.D)
    q = d + joint.lL * np.exp(1j * left)
    rod = q
    if joint.kind == "B2":
        rod = d + complex(*joint.R) * np.exp(1j * left)
    elif joint.kind == "B3":
        rod = q - complex(*joint.R) * np.exp(1j * right)
    return abs(rod - complex(*joint.C))
