"""What must not change, and what must scale, whatever the boom."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import booms
from reference.segments import equilibrium as segments

from boom_twin import simulate, statics

few = settings(max_examples=12, deadline=None, derandomize=True, database=None)
SEEDS = st.integers(0, 400)
SHIFT = st.floats(-5.0, 5.0)
FACTOR = st.floats(0.2, 5.0)


def spec_of(number):
    """A random boom as plain dicts, and its equilibrium."""
    scene = booms.random_boom(number)
    return scene.model_dump(exclude_none=True), statics(scene, posture="test", modes=3)


def result(spec):
    return statics(booms.scene_of(spec), posture="test", modes=3)


@few
@given(SEEDS, SHIFT, SHIFT)
def test_shifted_base_shifts_the_tip_only(number, dx, dy):
    spec, before = spec_of(number)
    moved = copy.deepcopy(spec)
    for key in ("pivot", "cylinder_pin"):
        moved["base"][key] = (spec["base"][key][0] + dx, spec["base"][key][1] + dy)
    after = result(moved)
    assert after.tip - before.tip == pytest.approx([dx, dy], abs=1e-9)
    assert after.joints == pytest.approx(before.joints, abs=1e-9)
    assert after.cylinder_forces == pytest.approx(before.cylinder_forces, rel=1e-6, abs=1e-3)
    assert after.frequencies == pytest.approx(before.frequencies, rel=1e-7)


@few
@given(SEEDS)
def test_inclined_base_is_turned_gravity(number):
    spec, before = spec_of(number)
    turn = -spec["base"].pop("inclination")
    gx, gy = spec["gravity"]
    spec["gravity"] = (
        math.cos(turn) * gx - math.sin(turn) * gy, math.sin(turn) * gx + math.cos(turn) * gy
    )  # fmt: skip
    after = result(spec)
    assert after.tip == pytest.approx(before.tip, abs=1e-10)
    assert after.frequencies == pytest.approx(before.frequencies, rel=1e-9)


@few
@given(SEEDS)
def test_without_gravity_the_boom_is_straight(number):
    spec, _ = spec_of(number)
    after = result(spec | {"gravity": (0.0, 0.0)})
    assert after.tip == pytest.approx(after.tip_rigid, abs=1e-10)
    assert np.all(np.abs(after.cylinder_forces) < 1e-3)


@few
@given(SEEDS, FACTOR)
def test_sag_is_proportional_to_a_small_load(number, factor):
    spec, _ = spec_of(number)
    sags = []
    for share in (1e-4, 1e-4 * factor):
        gx, gy = spec["gravity"]
        found = result(spec | {"gravity": (share * gx, share * gy)})
        sags.append(found.tip - found.tip_rigid)
    assert sags[1] == pytest.approx(factor * sags[0], abs=1e-3 * factor * np.linalg.norm(sags[0]) + 1e-9)


def scaled(spec, length, mass):
    """A geometrically similar boom, its masses times `mass`, stiffnesses such that strains under weight stay."""
    spec, s, m = copy.deepcopy(spec), length, mass

    def part(values):
        values["mass"], values["inertia"] = values["mass"] * m, values["inertia"] * m * s**2
        values["com"] = tuple(s * c for c in values["com"]) if isinstance(values["com"], tuple) else s * values["com"]

    for section in spec["sections"]:
        for key, power in (("length", 1), ("A", 2), ("I", 4)):
            if key in section:
                section[key] *= s**power
        for key, factor in (("rho_A", m / s), ("rho_I", m * s)):
            if key in section:
                section[key] *= factor
        for key in ("beam", "rod_pin"):
            if key in section:
                section[key] = tuple(s * x for x in section[key])
        for key in ("root", "head"):
            if key in section:
                part(section[key])
    for joint in spec["joints"]:
        for key in ("C", "D", "E", "R"):
            if key in joint:
                joint[key] = tuple(s * x for x in joint[key])
        for key, factor in (("lL", s), ("lR", s), ("mL", m), ("mR", m)):
            if key in joint:
                joint[key] *= factor
        cylinder = joint["cylinder"]
        for key, factor in (("closed_length", s), ("max_stroke", s), ("k", m / s), ("d", m / s)):
            if key in cylinder:
                cylinder[key] *= factor
        for key, factor in (("bore", s), ("rod", s), ("bulk_modulus", m / s**2), ("cap_line", s**3), ("rod_line", s**3)):
            if "oil" in cylinder:
                cylinder["oil"][key] *= factor
        for key in ("barrel", "rod"):
            if key in cylinder:
                part(cylinder[key])
    for key in ("pivot", "cylinder_pin"):
        spec["base"][key] = tuple(s * x for x in spec["base"][key])
    spec["material"]["E"] *= m / s**2
    if "tip" in spec:
        spec["tip"]["payload"] *= m
    if "line_fill" in spec:
        spec["line_fill"] *= m / s
    return spec


@few
@given(SEEDS, st.floats(0.3, 3.0), st.floats(0.1, 10.0))
def test_similar_booms_behave_alike(number, length, mass):
    """Lengths s, masses m, forces m: angles stay, frequencies scale with s^-1/2. A check of all dimensions."""
    spec, before = spec_of(number)
    after = result(scaled(spec, length, mass))
    assert after.tip == pytest.approx(length * before.tip, rel=1e-9, abs=1e-8 * length)
    assert after.joints == pytest.approx(before.joints, abs=1e-8)
    assert after.cylinder_forces == pytest.approx(mass * before.cylinder_forces, rel=1e-6, abs=1e-3 * mass)
    assert after.frequencies == pytest.approx(before.frequencies / math.sqrt(length), rel=1e-7)


def test_similar_booms_move_alike():
    """The same, in motion with damping: time scales with s^1/2."""
    s, scene = 2.0, booms.scene_of(booms.document())
    spec = scaled(scene.model_dump(exclude_none=True), s, 3.0)
    for section in spec["sections"]:
        section["beta"] *= math.sqrt(s)
    for joint in spec["joints"]:
        joint["cylinder"]["d"] *= math.sqrt(s)
    times = np.linspace(0.0, 0.4, 41)
    strokes = statics(scene, posture="arch", modes=0).strokes + np.outer(times**3, [0.3, -0.1, 0.2, 0.1])
    before = simulate(scene, times, strokes, dt=2e-3)
    after = simulate(booms.scene_of(spec), math.sqrt(s) * times, s * strokes, dt=2e-3 * math.sqrt(s))
    assert after.tip[:, :2] == pytest.approx(s * before.tip[:, :2], abs=1e-7)
    assert after.tip_acceleration[:, :2] == pytest.approx(before.tip_acceleration[:, :2], abs=1e-4)
    assert after.cylinder_forces == pytest.approx(3.0 * before.cylinder_forces, rel=1e-5)


def test_line_fill_is_mass_of_the_beam_where_the_beam_is_the_section():
    spec = booms.document()
    for section in spec["sections"]:
        section |= {"beam": [0.0, section["length"]]}
    filled = statics(booms.scene_of(spec | {"line_fill": 7.0}), posture="arch")
    for section in spec["sections"]:
        section["rho_A"] += 7.0
    heavier = statics(booms.scene_of(spec), posture="arch")
    assert filled.tip == pytest.approx(heavier.tip, abs=1e-12)
    assert filled.frequencies == pytest.approx(heavier.frequencies, rel=1e-10)


def test_payload_is_a_point_mass_of_the_last_head():
    spec = booms.document()
    loaded = statics(booms.scene_of(spec | {"tip": {"payload": 40.0}}), posture="arch")
    head = spec["sections"][3]["head"]  # its centre is the outboard pivot
    head["mass"] += 40.0
    heavier = statics(booms.scene_of(spec), posture="arch")
    assert loaded.tip == pytest.approx(heavier.tip, abs=1e-12)
    assert loaded.frequencies == pytest.approx(heavier.frequencies, rel=1e-10)


@few
@given(SEEDS.filter(lambda number: number % 5 < 3))  # up to three sections
def test_work_of_the_drives_is_the_rise_of_the_potential(number):
    """Quasi-static virtual work: d(energy)/d(stroke) = -force, the energy taken from the oracle at fineness 2."""
    scene = booms.random_boom(number)
    angles = np.diff(np.radians(scene.postures["test"]), prepend=0.0)
    model = segments.Segments(scene, 2)
    drive = segments.Segments(scene, 0).lengths(angles)
    forces = statics(scene, posture="test", modes=0).cylinder_forces
    for i in range(len(drive)):
        energies = []
        for sign in (1.0, -1.0):
            length = drive.copy()
            length[i] += sign * 1e-4
            _, boom, _, _ = segments.equilibrium(model, length, angles)
            energies.append(segments.energy(model, boom, length)[0].v)
        assert -(energies[0] - energies[1]) / 2e-4 == pytest.approx(forces[i], rel=5e-3, abs=1.0)


def test_a_split_without_force_changes_nothing():
    """The barrel pin of a weightless section splits the beam or, on the head, does not: the beam bends alike."""
    pivots = []
    for c in ([-1.5, 0.15], [-0.22, 0.55]):
        spec = booms.document()
        spec |= {"sections": spec["sections"][:2], "joints": spec["joints"][:2], "postures": {"down": [0.0, -60.0]}}
        spec["joints"][1] |= {"C": c, "cylinder": {"k": 3e7, "closed_length": 0.3, "max_stroke": 3.0}, "mL": 0.0, "mR": 0.0}
        spec["sections"][1] = {"length": 3.3}
        found = statics(booms.scene_of(spec), posture="down", modes=0)
        pivots.append(found.outline[-2])
        assert np.linalg.norm(found.tip - pivots[-1]) == pytest.approx(3.3)
    assert pivots[0][1] < -2e-3  # it does sag
    assert pivots[0] == pytest.approx(pivots[1], abs=1e-9)
