"""URDF of a scene for robot_state_publisher, RViz and Foxglove, and the views of these programs for a boom in a namespace."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ..kernels.elements.linkage import LINK_L
from ..scene.kinematics import CYLINDER, LEFT, RIGHT, linkage
from ..scene.schema import Scene
from .topic_table import FRAME, TIP_JOINTS, load_topics

NAME = "boom"
TIP, TIP_RIGID, TIP_ALONG, TIP_ACROSS, IMU = "tip", "tip_rigid", "tip_along", "tip_across", "imu_link"
UP_IS_POSITIVE = "0 -1 0"  # axis of every revolute joint (REP-103: x forward, z up): a positive angle raises what it turns
COLOURS = {"section": "0.55 0.62 0.70 1", "link": "0.35 0.40 0.46 1", "barrel": "0.90 0.45 0.10 1", "rod": "0.80 0.82 0.85 1"}

ELASTIC_BASE = """
This scene has an elastic base. Sections, links and cylinders are drawn on the unloaded base; only tip and imu_link, and
~/shape, have its turn.
"""


def urdf(scene: Scene) -> str:
    """Return the URDF document of `scene`, with its links and joints explained in a comment at the top.

    ``~/joint_states`` has the positions of its joints. Those of the passive joints are from
    `boom_twin.scene.kinematics.PassiveJoints`.
    """
    robot = Element("robot", name=NAME)
    robot.append(ElementTree.Comment(f"\n{ABOUT.read_text()}"))
    if scene.base.stiffness is not None:
        robot.append(ElementTree.Comment(ELASTIC_BASE))
    for name, rgba in COLOURS.items():
        SubElement(SubElement(robot, "material", name=name), "color", rgba=rgba)
    SubElement(robot, "link", name=FRAME)
    for i in range(len(scene.sections)):
        _section(robot, scene, i)
        _cylinder(robot, scene, i)
        if scene.joints[i].kind != "A":
            _links(robot, scene, i)
    _tip(robot, scene)
    ElementTree.indent(robot)
    return f'<?xml version="1.0"?>\n{ElementTree.tostring(robot, encoding="unicode")}\n'


def _section(robot: Element, scene: Scene, i: int) -> None:
    """Add section `i` (0-based) and the joint that turns it."""
    name, depth = f"section_{i + 1}", scene.sections[i].depth
    link = SubElement(robot, "link", name=name)
    _bar(link, (0.0, 0.0), (scene.sections[i].length, 0.0), depth, "section")
    low, high = (math.radians(angle) for angle in scene.joints[i].range_deg)
    joint = _joint(robot, f"joint_{i + 1}", "revolute", _carrying_link(i), name, _pivot(scene, i))
    _limit(joint, low, high)


def _cylinder(robot: Element, scene: Scene, i: int) -> None:
    """Add barrel and rod of cylinder `i` (0-based), a swivel at the barrel pin, and a prismatic joint for the stroke."""
    part, row, pivot = scene.joints[i].cylinder, linkage(scene, i), _pivot(scene, i)
    barrel, rod, closed = f"cylinder_{i + 1}_barrel", f"cylinder_{i + 1}_rod", part.closed_length
    eye = 0.1 * closed  # of the rod, outside the barrel
    _tube(SubElement(robot, "link", name=barrel), 0.0, closed - eye, 0.045 * closed, "barrel")
    _tube(SubElement(robot, "link", name=rod), -part.max_stroke - eye, 0.0, 0.025 * closed, "rod")
    _joint(robot, CYLINDER.format(i + 1), "continuous", _carrying_link(i), barrel, (pivot[0] + row.cx, pivot[1] + row.cy))
    stroke = _joint(robot, f"cylinder_{i + 1}", "prismatic", barrel, rod, (closed, 0.0), axis="1 0 0")
    _limit(stroke, 0.0, part.max_stroke)


def _links(robot: Element, scene: Scene, i: int) -> None:
    """Add links L and R of the six-bar `i` (0-based), each on its pin on a section. One of them carries the rod pin."""
    row, pivot = linkage(scene, i), _pivot(scene, i)
    left, right = f"link_l_{i + 1}", f"link_r_{i + 1}"
    for name, length, carries in ((left, row.length_l, row.mount == LINK_L), (right, row.length_r, row.mount != LINK_L)):
        link = SubElement(robot, "link", name=name)
        side = 0.06 * length
        _bar(link, (0.0, 0.0), (length, 0.0), side, "link")
        if carries and row.left:
            for start in (0.0, length):
                _bar(link, (start, 0.0), (row.along, row.left), side, "link")
    _joint(robot, LEFT.format(i + 1), "continuous", _carrying_link(i), left, (pivot[0] + row.dx, pivot[1] + row.dy))
    _joint(robot, RIGHT.format(i + 1), "continuous", f"section_{i + 1}", right, (row.ex, row.ey))


def _tip(robot: Element, scene: Scene) -> None:
    """Add the joints from the end of the last section to the tip of the deflected boom, and the IMU at the tip."""
    for name in (TIP_RIGID, TIP_ALONG, TIP_ACROSS, TIP, IMU):
        SubElement(robot, "link", name=name)
    _joint(robot, "tip_fixed", "fixed", f"section_{len(scene.sections)}", TIP_RIGID, (scene.sections[-1].length, 0.0))
    reach = sum(section.length for section in scene.sections)
    along, across, pitch = TIP_JOINTS
    _limit(_joint(robot, along, "prismatic", TIP_RIGID, TIP_ALONG, (0.0, 0.0), axis="1 0 0"), -reach, reach)
    _limit(_joint(robot, across, "prismatic", TIP_ALONG, TIP_ACROSS, (0.0, 0.0), axis="0 0 1"), -reach, reach)
    _joint(robot, pitch, "continuous", TIP_ACROSS, TIP, (0.0, 0.0))
    _joint(robot, "imu_fixed", "fixed", TIP, IMU, (0.0, 0.0))


def _carrying_link(i: int) -> str:
    return f"section_{i}" if i else FRAME


def _pivot(scene: Scene, i: int) -> tuple[float, float]:
    """Return the pivot of joint `i` (0-based) in the frame of its carrier, m."""
    return (scene.sections[i - 1].length, 0.0) if i else scene.base.pivot


def _joint(
    robot: Element, name: str, kind: str, parent: str, child: str, origin: Sequence[float], axis: str = UP_IS_POSITIVE
) -> Element:
    """Add a joint whose origin (x, y of the model plane, m) is given in the frame of its parent, and return it."""
    joint = SubElement(robot, "joint", name=name, type=kind)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    SubElement(joint, "origin", xyz=_xyz(*origin), rpy="0 0 0")
    if kind != "fixed":
        SubElement(joint, "axis", xyz=axis)
    return joint


def _limit(joint: Element, low: float, high: float) -> None:
    SubElement(joint, "limit", lower=_number(low), upper=_number(high), effort="0", velocity="0")


def _bar(link: Element, start: tuple[float, float], end: tuple[float, float], depth: float, colour: str) -> None:
    """Add a square bar between two points of the model plane, m."""
    x, y = end[0] - start[0], end[1] - start[1]
    middle = start[0] + 0.5 * x, start[1] + 0.5 * y
    geometry = _visual(link, middle, f"0 {_number(-math.atan2(y, x))} 0", colour)
    SubElement(geometry, "box", size=" ".join(map(_number, (math.hypot(x, y), depth, depth))))


def _tube(link: Element, start: float, end: float, radius: float, colour: str) -> None:
    """Add a round bar along x; lengths in m."""
    geometry = _visual(link, (0.5 * (start + end), 0.0), f"0 {_number(0.5 * math.pi)} 0", colour)
    SubElement(geometry, "cylinder", length=_number(end - start), radius=_number(radius))


def _visual(link: Element, middle: tuple[float, float], rpy: str, colour: str) -> Element:
    visual = SubElement(link, "visual")
    SubElement(visual, "origin", xyz=_xyz(*middle), rpy=rpy)
    geometry = SubElement(visual, "geometry")
    SubElement(visual, "material", name=colour)
    return geometry


def _xyz(x: float, y: float) -> str:
    """Return a point of the model plane in REP-103 axes as text."""
    return f"{_number(x)} 0 {_number(y)}"


def _number(value: float) -> str:
    """Return a number as text with ten digits; -0 becomes 0."""
    return f"{value + 0.0:.10g}"


FOLDER = Path(str(files("boom_twin") / "msg_config"))
RVIZ, FOXGLOVE, PLOTJUGGLER = (FOLDER / name for name in ("boom_twin.rviz", "foxglove.json", "plotjuggler.xml"))
VIEWS = (RVIZ, FOXGLOVE, PLOTJUGGLER)
ABOUT = FOLDER / "urdf.txt"  # explanation at the top of every URDF
DESCRIPTION = "/robot_description"  # topic of robot_state_publisher
TF_PREFIX = "TF Prefix:"  # key of the frame prefix in RViz's display of a robot model


def view_text(text: str, namespace: str = "", frame_prefix: str = "") -> str:
    """Return the text of a view (one of `VIEWS`, or similar) for the ROS namespace and frame prefix (``front/``) of a boom.

    Quoted absolute names are put into the namespace; relative ones, as RViz's, follow its own.
    """
    usual, there = load_topics(), load_topics().in_namespace(namespace)
    space = namespace.strip("/")
    names = {topic.absolute: there.inputs[key].absolute for key, topic in usual.inputs.items()}
    names |= {topic.absolute: there.outputs[key].absolute for key, topic in usual.outputs.items()}
    names[DESCRIPTION] = f"/{space}{DESCRIPTION}" if space else DESCRIPTION
    longest_first = "|".join(re.escape(name) for name in sorted(names, key=len, reverse=True))
    text = re.sub(rf'(?<=[";])({longest_first})(?=[/.";\[])', lambda found: names[found[0]], text)
    text = re.sub(rf"(?<![\w/]){FRAME}\b", f"{frame_prefix}{FRAME}", text)
    return re.sub(rf'{TF_PREFIX} ""', f'{TF_PREFIX} "{frame_prefix}"', text)
