"""The URDF: well-formed by the format's rules, joints those of ``~/joint_states``, pins where the geometry has them."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
import pytest
from default_boom import examine_text, example_text, skeleton, stroke_curve
from drive_twin import drive_twin
from ros_messages import Output, ReportEncoder, decoded

from boom_twin import Sample, Scene, Settings, Stream, load_scene
from boom_twin.messages.urdf import urdf
from boom_twin.scene.kinematics import PassiveJoints

# What urdf.xsd of urdfdom and the wiki's page say of the elements used here: attributes, children
# (name: fewest, most), all else refused.
MANY = 1000
SCHEMA: dict[str, tuple[set[str], dict[str, tuple[int, int]]]] = {
    "robot": ({"name"}, {"material": (0, MANY), "link": (1, MANY), "joint": (0, MANY)}),
    "robot/material": ({"name"}, {"color": (1, 1)}),
    "robot/link": ({"name"}, {"visual": (0, MANY)}),
    "link/visual": (set(), {"origin": (0, 1), "geometry": (1, 1), "material": (0, 1)}),
    "visual/material": ({"name"}, {}),
    "visual/geometry": (set(), {"box": (0, 1), "cylinder": (0, 1)}),
    "geometry/box": ({"size"}, {}),
    "geometry/cylinder": ({"length", "radius"}, {}),
    "robot/joint": ({"name", "type"}, {"parent": (1, 1), "child": (1, 1), "origin": (0, 1), "axis": (0, 1), "limit": (0, 1)}),
    "joint/parent": ({"link"}, {}),
    "joint/child": ({"link"}, {}),
    "joint/axis": ({"xyz"}, {}),
    "joint/limit": ({"lower", "upper", "effort", "velocity"}, {}),
    "material/color": ({"rgba"}, {}),
    "visual/origin": ({"xyz", "rpy"}, {}),
    "joint/origin": ({"xyz", "rpy"}, {}),
}  # fmt: skip
NUMBERS = {"xyz": 3, "rpy": 3, "size": 3, "rgba": 4, "length": 1, "radius": 1, "lower": 1, "upper": 1, "effort": 1}
NUMBERS["velocity"] = 1


def check(element: Element, place: str = "robot") -> None:
    """Refuse what the schema does not have."""
    attributes, children = SCHEMA[place]
    assert element.attrib.keys() == attributes, place
    tags = [child.tag for child in element if isinstance(child.tag, str)]
    assert set(tags) <= children.keys(), place
    for tag, (fewest, most) in children.items():
        assert fewest <= tags.count(tag) <= most, (place, tag)
    for name, count in NUMBERS.items():
        if name in element.attrib:
            assert np.isfinite([float(text) for text in element.attrib[name].split()]).sum() == count
    for child in element:
        check(child, f"{element.tag}/{child.tag}")


def booms() -> dict[str, Scene]:
    """The default, its first section alone, one with the links' kinds shuffled, one with a rigid section."""
    scene = load_scene()
    sections, joints = scene.sections, scene.joints
    order = [0, 3, 1, 2]
    rigid = sections[1].model_copy(update=dict.fromkeys(("beam", "A", "I", "rho_A", "rho_I", "beta", "head")))
    base = scene.base.model_copy(update={"pivot": (0.3, 0.8), "cylinder_pin": (0.75, -0.45), "inclination": 0.1})
    return {
        "default": scene,
        "one": scene.model_copy(update={"sections": sections[:1], "joints": joints[:1]}),
        "shuffled": scene.model_copy(update={"base": base, "joints": tuple(joints[i] for i in order)}),
        "z fold": examine_text(example_text("five_section_z_fold"), "example")[0],
        "rigid": scene.model_copy(update={"sections": (sections[0], rigid, *sections[2:])}),
    }


@pytest.fixture(scope="module", params=["default", "one", "shuffled", "z fold", "rigid"])
def boom(request: pytest.FixtureRequest) -> tuple[Scene, Element]:
    scene = booms()[request.param]
    return scene, ElementTree.fromstring(urdf(scene))


def test_it_is_a_tree_from_base_link_with_the_joints_of_the_scene(boom: tuple[Scene, Element]) -> None:
    scene, robot = boom
    check(robot)
    links = [link.attrib["name"] for link in robot.findall("link")]
    names = [joint.attrib["name"] for joint in robot.findall("joint")]
    assert len(set(links)) == len(links) and len(set(names)) == len(names)
    assert frames(robot, {}).keys() == set(links)
    n = range(1, len(scene.sections) + 1)
    expected = {"base_link", "tip_rigid", "tip_along", "tip_across", "tip", "imu_link", *(f"section_{i}" for i in n)}
    expected |= {f"cylinder_{i}_{part}" for i in n for part in ("barrel", "rod")}
    expected |= {f"link_{side}_{i}" for i in n if scene.joints[i - 1].kind != "A" for side in "lr"}
    assert set(links) == expected
    colours = {material.attrib["name"] for material in robot.findall("material")}
    assert {material.attrib["name"] for material in robot.findall("link/visual/material")} <= colours
    axes = {(joint.attrib["type"], joint.find("axis").attrib["xyz"]) for joint in robot.findall("joint[axis]")}
    assert axes == {("revolute", "0 -1 0"), ("continuous", "0 -1 0"), ("prismatic", "1 0 0"), ("prismatic", "0 0 1")}
    for i, joint in enumerate(scene.joints, start=1):
        angles, strokes = (robot.find(f"joint[@name='{kind}_{i}']/limit").attrib for kind in ("joint", "cylinder"))
        np.testing.assert_allclose(np.degrees([float(angles["lower"]), float(angles["upper"])]), joint.range_deg)
        assert (float(strokes["lower"]), float(strokes["upper"])) == (0.0, joint.cylinder.max_stroke)


def frames(robot: Element, positions: dict[str, float]) -> dict[str, np.ndarray]:
    """Pose of every link, shape (4, 4), by the rules of URDF: origin, then the joint's motion; 0 where none is given."""
    poses, joints = {"base_link": np.eye(4)}, robot.findall("joint")
    while joints:
        ready = [joint for joint in joints if joint.find("parent").attrib["link"] in poses]
        assert ready, "not reached from base_link"
        for joint in ready:
            joints.remove(joint)
            pose = np.eye(4)
            pose[:3, 3] = [float(text) for text in joint.find("origin").attrib["xyz"].split()]
            assert joint.find("origin").attrib["rpy"] == "0 0 0"
            value = positions.get(joint.attrib["name"], 0.0)
            pose = poses[joint.find("parent").attrib["link"]] @ pose @ motion(joint, value)
            poses[joint.find("child").attrib["link"]] = pose
    return poses


def motion(joint: Element, value: float) -> np.ndarray:
    """What a joint does at `value`, by Rodrigues' formula where it turns."""
    pose = np.eye(4)
    if joint.attrib["type"] == "fixed":
        return pose
    axis = np.array([float(text) for text in joint.find("axis").attrib["xyz"].split()])
    if joint.attrib["type"] == "prismatic":
        pose[:3, 3] = value * axis
        return pose
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    pose[:3, :3] += np.sin(value) * cross + (1.0 - np.cos(value)) * cross @ cross
    return pose


@pytest.mark.parametrize("share", [0.05, 0.4, 0.75, 0.97])
def test_pins_are_where_the_geometry_has_them(boom: tuple[Scene, Element], share: float) -> None:
    """Both ways around every loop lead to the same point."""
    scene, robot = boom
    low, high = np.radians([joint.range_deg for joint in scene.joints]).T
    angles = low + share * (high - low)
    bones, passive = skeleton(scene, angles), PassiveJoints(scene)
    positions = {f"joint_{i}": angle for i, angle in enumerate(angles, start=1)}
    positions |= dict(zip(passive.names, passive.positions(angles), strict=True))
    for i, joint in enumerate(bones.joints, start=1):
        length = np.hypot(*(joint.rod_pin - joint.barrel_pin))
        positions[f"cylinder_{i}"] = length - scene.joints[i - 1].cylinder.closed_length
    poses = frames(robot, positions)
    at(poses["tip"], (0.0, 0.0), bones.pivots[-1])
    for i, joint in enumerate(bones.joints, start=1):
        at(poses[f"section_{i}"], (0.0, 0.0), joint.named["the pivot"])
        at(poses[f"cylinder_{i}_barrel"], (0.0, 0.0), joint.barrel_pin)
        at(poses[f"cylinder_{i}_rod"], (0.0, 0.0), joint.rod_pin)
        if (pins := joint.named).get("Q") is not None:
            at(poses[f"link_l_{i}"], (0.0, 0.0), pins["D"])
            at(poses[f"link_r_{i}"], (0.0, 0.0), pins["E"])
            at(poses[f"link_l_{i}"], (scene.joints[i - 1].lL, 0.0), pins["Q"])
            at(poses[f"link_r_{i}"], (scene.joints[i - 1].lR, 0.0), pins["Q"])


def at(pose: np.ndarray, own: tuple[float, float], expected: Any) -> None:
    """A point (x, y of the model) of a link lies at `expected` (x, y of the model)."""
    point = pose @ [own[0], 0.0, own[1], 1.0]
    np.testing.assert_allclose(point[:3], [expected[0], 0.0, expected[1]], atol=1e-8)


@pytest.mark.parametrize("name", ["default", "one", "shuffled"])
def test_the_joints_lead_to_the_tip_that_is_predicted(name: str) -> None:
    """Position and pitch of the frame ``tip`` by the rules of URDF, while the boom moves; apart from that of straight ones."""
    scene = booms()[name]
    twin, encoder, robot = drive_twin(scene), ReportEncoder(scene, Settings()), ElementTree.fromstring(urdf(scene))
    middle = np.radians([sum(joint.range_deg) / 2 for joint in scene.joints])
    begin = np.array([stroke_curve(scene, i, middle[i : i + 1])[0] for i in range(len(middle))])
    apart = []
    for k in range(40):
        report = twin.update(Sample(Stream.STROKES, k * 5_000_000, begin + 1e-3 * np.sin(0.3 * k)))
        predicted = report.prediction
        assert predicted is not None
        msg = decoded(dict(encoder.fill(report))[Output.JOINT_STATES], Output.JOINT_STATES)
        poses = frames(robot, dict(zip(msg.name, msg.position.tolist(), strict=True)))
        at(poses["tip"], (0.0, 0.0), predicted.tip_position)
        along = [np.cos(predicted.tip_angle), 0.0, np.sin(predicted.tip_angle)]
        np.testing.assert_allclose(poses["tip"][:3, 0], along, atol=1e-9)
        apart.append(np.linalg.norm(poses["tip"][:3, 3] - poses["tip_rigid"][:3, 3]))
    assert max(apart) > 5e-4
