"""Signatures against equilibria of changed scenes, worked out by larger steps of their own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracle import booms

from boom_twin import load_scene
from boom_twin.analysis.equilibrium import statics
from boom_twin.config.settings import Settings
from boom_twin.errors import BoomTwinError
from boom_twin.health.inference.block_problem import BlockMeans, LinearModel, MeasuredRows
from boom_twin.health.inference.fault_catalogue import Form, parameters, physical, step_of
from boom_twin.health.inference.sensitivities import Signatures
from boom_twin.scene.edit import parameter, with_parameters
from boom_twin.scene.kinematics import strokes_of_posture

CLOSE = 0.02  # of the largest entry of a column: central differences of large steps against small forward ones


def read(scene, strokes):
    """Angles, IMU and tip at rest, from statics alone: the tip's angle is that of the last bit of the centre line."""
    rest = statics(scene, strokes, modes=1)
    return np.concatenate([rest.joints, rest.tip])


def central(scene_of, strokes_of, step):
    return (read(scene_of(step), strokes_of(step)) - read(scene_of(-step), strokes_of(-step))) / (2.0 * step)


def found(signature, n, column):
    return np.concatenate([signature.channels[:n, column], signature.tip[:, column]])


def close(one, other, share=CLOSE):
    for part in (slice(0, -2), slice(-2, None)):  # angles, tip
        assert np.abs(one[part] - other[part]).max() <= share * np.abs(other[part]).max() + 1e-9


def two_sections():
    spec = booms.document()
    spec["sections"], spec["joints"] = spec["sections"][:2], spec["joints"][:2]
    spec["postures"] = {name: angles[:2] for name, angles in spec["postures"].items()}
    del spec["joints"][1]["cylinder"]["k"]
    spec["joints"][1]["cylinder"].pop("d", None)
    return booms.scene_of(spec)


BOOMS = {"default": load_scene, "two sections, one stiff cylinder": two_sections}


@pytest.fixture(scope="module", params=[(name, posture) for name in BOOMS for posture in ("arch", "horizontal")], ids=str)
def made(request):
    name, posture = request.param
    scene = BOOMS[name]()
    posture = posture if posture in scene.postures else sorted(scene.postures)[0]
    known, strokes = parameters(scene), strokes_of_posture(scene, posture)
    signature = Signatures(scene, known, (None,) * len(scene.joints)).at(strokes)
    assert signature is not None
    return scene, known, strokes, signature


def test_parameters_of_the_scene(made):
    scene, known, strokes, signature = made
    for column, each in enumerate(known):
        if each.form is not Form.SCENE:
            continue
        step = {"": 0.03, "kg": 5.0, "kg/m": 1.0, "rad": 0.02}[each.unit]
        own = parameter(scene, each.cause)
        is_load = each.unit in ("kg", "kg/m")
        more = step if is_load and own < step else 0.0  # so that both sides of the difference have a positive load

        def scene_of(value, each=each, own=own, more=more):
            changed = own + value + more if more else physical(each, scene, value)
            return with_parameters(scene, {each.cause: changed})

        close(found(signature, len(strokes), column), central(scene_of, lambda _: strokes, step), 0.05)


def test_strokes(made):
    """A stroke that is read too long makes the twin's boom another: measured minus predicted is the opposite of its slope."""
    scene, known, strokes, signature = made
    n, forces = len(strokes), statics(scene, strokes, modes=1).cylinder_forces
    for column, each in enumerate(known):
        if each.form not in (Form.STROKE, Form.SCALE, Form.PLAY):
            continue
        unit = np.eye(n)[each.index]
        slope = central(lambda _: scene, lambda step, unit=unit: strokes + step * unit, 1e-3)
        factor = {Form.STROKE: -1.0, Form.SCALE: -strokes[each.index], Form.PLAY: np.sign(forces[each.index])}[each.form]
        close(found(signature, n, column), factor * slope)
        if each.form is Form.STROKE:
            assert signature.by_stroke[:n, each.index] == pytest.approx(-signature.channels[:n, column])
            assert signature.tip_by_stroke[:, each.index] == pytest.approx(-signature.tip[:, column])


def test_sensors_show_in_their_own_channel_alone(made):
    _, known, strokes, signature = made
    n = len(strokes)
    for column, each in enumerate(known):
        both = np.concatenate([signature.channels[:, column], signature.tip[:, column]])
        if each.form in (Form.ANGLE, Form.IMU):
            wanted = np.zeros(n + 4)
            wanted[each.index + (n if each.form is Form.IMU else 0)] = 1.0
            assert both.tolist() == wanted.tolist()
        if each.form is Form.DELAY:
            assert not both.any(), "what depends on time and motion is filled in later"


def test_scales_are_of_what_is_read(made):
    """At the posture of the block, though signatures are made anew only after a centimetre of stroke."""
    scene, known, strokes, signature = made
    n = len(strokes)
    model = LinearModel(scene, Settings(), (None,) * n, known)
    moved = strokes + 0.009
    none, rows = np.zeros(n + 2), MeasuredRows(np.zeros(0, np.int64), np.zeros((0, 2)), np.zeros((0, 2)))
    table = model._table(BlockMeans(0, none, none, moved, np.zeros(n), none, 0.0, rows, False), signature)
    here, there = (statics(scene, where, modes=1).joints for where in (strokes, moved))
    for column, each in enumerate(known):
        if each.form is Form.ANGLE_SCALE:
            own, later, i = signature.channels[:, column], table[:, 1 + column], each.index
            assert own[i] == pytest.approx(here[i], abs=1e-5) and np.count_nonzero(own) == 1
            assert later[i] == pytest.approx(there[i], abs=0.02 * abs(there[i] - here[i])) and np.count_nonzero(later) == 1
        if each.form is Form.SCALE:
            assert table[:, 1 + column] == pytest.approx(-signature.by_stroke[:, each.index] * moved[each.index])


def test_the_imu_at_rest_feels_gravity_turned_with_the_tip(made):
    """Its two axes turn by what all angles together do, so that they change along the other's reading."""
    scene, known, strokes, signature = made
    n = len(strokes)
    column = next(i for i, each in enumerate(known) if each.cause == "tip.payload")
    dx, dz = signature.channels[n:, column]
    outline = statics(scene, strokes, modes=1).outline
    angle = math.atan2(*(outline[-1] - outline[-2])[::-1])
    turned = dx / (9.81 * math.cos(angle))
    assert turned < 0.0, "the tip bends down under more load"
    assert dz == pytest.approx(-9.81 * math.sin(angle) * turned, rel=0.1, abs=0.05 * abs(dx))
    assert math.hypot(dx, dz) == pytest.approx(9.81 * abs(turned), rel=0.1)


def test_an_inclined_base_turns_gravity_for_the_imu(made):
    """Nearly the whole of it: what the boom gives way by, under the weight that turns, is a few hundredths of that."""
    scene, known, strokes, signature = made
    n = len(strokes)
    column = next(i for i, each in enumerate(known) if each.cause == "base.inclination")
    outline = statics(scene, strokes, modes=1).outline
    angle = math.atan2(*(outline[-1] - outline[-2])[::-1])
    wanted = 9.81 * np.array([math.cos(angle), -math.sin(angle)])
    assert np.abs(signature.channels[n:, column] - wanted).max() < 0.05 * 9.81


def test_an_incompressible_cylinder_has_no_stiffness():
    names = {each.name for each in parameters(two_sections())}
    assert "cylinder_1.k:softer" in names and "cylinder_2.k:softer" not in names
    assert "cylinder_2.sensor:bias" in names and not any("_3" in name for name in names)


def test_no_two_parameters_share_a_name():
    known = parameters(load_scene())
    assert len({each.name for each in known}) == len(known)


def test_a_step_and_what_it_means_agree():
    scene = load_scene()
    for each in parameters(scene):
        if each.form is Form.SCENE:
            step, values = step_of(each, scene)
            assert values == {each.cause: pytest.approx(physical(each, scene, step))}
            assert physical(each, scene, 0.0) == pytest.approx(parameter(scene, each.cause))


def test_inclinometers_feel_every_joint_inboard():
    """At the root of section 3: the change of three joints, and of the bending of two sections between them."""
    scene = load_scene()
    known, strokes = parameters(scene), strokes_of_posture(scene, "arch")
    encoders = Signatures(scene, known, (None,) * 4).at(strokes)
    absolute = Signatures(scene, known, (None, None, "root", None)).at(strokes)
    base = Signatures(scene, known, ("root", None, None, None)).at(strokes)
    assert absolute.channels[[0, 1, 3]] == pytest.approx(encoders.channels[[0, 1, 3]], abs=1e-7)
    tilt = np.array([each.cause == "base.inclination" for each in known])
    assert base.channels[0] - tilt == pytest.approx(encoders.channels[0], abs=1e-7), "the first joint's own, and the base's"
    inboard = next(i for i, each in enumerate(known) if each.name == "cylinder_1.k:softer")
    assert abs(absolute.channels[2, inboard]) > 10.0 * abs(encoders.channels[2, inboard])
    assert absolute.channels[2, inboard] == pytest.approx(encoders.channels[:3, inboard].sum(), rel=0.1)
    own = next(i for i, each in enumerate(known) if each.name == "joint_3.sensor:bias")
    assert absolute.channels[:, own].tolist() == encoders.channels[:, own].tolist()


def test_the_way_does_not_matter():
    """Followed there in small steps, or started there; back and forth."""
    scene = load_scene()
    known, strokes = parameters(scene), strokes_of_posture(scene, "arch")
    aim = strokes + np.array([0.05, -0.04, 0.03, 0.02])
    followed = Signatures(scene, known, (None,) * 4)
    for share in np.linspace(0.0, 1.0, 6):
        there = followed.at(strokes + share * (aim - strokes))
    alone = Signatures(scene, known, (None,) * 4).at(aim)
    scale = np.abs(alone.channels).max(axis=0) + 1e-9
    assert np.abs((there.channels - alone.channels) / scale).max() < 5e-3
    assert there.strokes.tolist() == aim.tolist() and there.strokes is not aim


def test_without_an_equilibrium_there_is_none():
    """And it goes on when there is one again."""
    scene = load_scene()
    strokes = strokes_of_posture(scene, "arch")
    signatures = Signatures(scene, parameters(scene), (None,) * 4)
    before = signatures.at(strokes)
    with pytest.raises(BoomTwinError):
        statics(scene, strokes - 5.0)
    assert signatures.at(strokes - 5.0) is None
    again = signatures.at(strokes)
    assert again.channels == pytest.approx(before.channels, rel=1e-3, abs=1e-6)
