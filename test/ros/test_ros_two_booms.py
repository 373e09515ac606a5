"""Two booms on one computer, each with a namespace, a frame prefix, a page and a recording of its own, at the same time."""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.request import urlopen
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("aiohttp")

import rclpy
from rclpy.node import NodeNameNonExistentError
from recordings import load_mapping, mapping_of, read, scan
from ros_messages import TYPES, Output
from ros_rig import all_stored, published
from ruamel.yaml import YAML

import boom_twin
from boom_twin import replay
from boom_twin.ros.bag.recorder import COMPLETE
from boom_twin.ros.runtime import message_class, qos_profile

BOOMS = {"front": "0.0", "rear": "1.0"}
"""Their namespaces, and from when on the session is played to each, s."""
NODES = ("boom_twin", "boom_twin_recorder", "boom_twin_monitor")
ALONE = "/alone"
SLOWLY = ("--namespace", ALONE.strip("/"), "--rate", "0.01", "--wait", "0")
PLAYED = ("cylinder_strokes", "joint_angles", "tip_imu", "rosout", "parameter_events")
CONFIG = Path(boom_twin.__file__).parent / "msg_config"
OPTIONAL = {"/front/cylinder_forces", "/clock"}
"""What there is with forces in the session, with --clock."""
PAGE = re.compile(r"open (http://127\.0\.0\.1:\d+/)")


@pytest.fixture(scope="module")
def recorded(
    spawn: Callable[..., Any], spawn_node: Callable[..., Any], reliable_bag: Path, mapping: Path, tmp_path_factory: Any
) -> dict[str, Any]:
    """By boom its recording and the address of its page."""
    folder, command = tmp_path_factory.mktemp("booms"), "boom_twin.cli.main"
    options = ("-p", "monitor:=true", "-p", f"mapping:={mapping}")
    nodes = {name: spawn_node("-r", f"__ns:=/{name}", "-p", f"frame_prefix:={name}/", *options) for name in BOOMS}
    for name, node in nodes.items():
        node.wait_for(f"listening to /{name}/cylinder_strokes")
    recorders = {
        name: spawn(command, "record", "--out", str(folder / name), "--mapping", str(mapping), "--namespace", name)
        for name in BOOMS
    }
    graph = rclpy.create_node("graph")
    silent = [
        graph.create_publisher(message_class(topic.type), f"/{name}{topic.absolute}", qos_profile(topic.qos))
        for name in BOOMS
        for topic in load_mapping(mapping).inputs.values()
    ]
    for recorder in recorders.values():  # it hears all of the node, which it may have found late, before anything is played
        recorder.wait_for(COMPLETE)
    for publisher in silent:
        graph.destroy_publisher(publisher)
    players = [
        spawn(command, "play", str(reliable_bag), "--namespace", name, "--start", start, "--listeners", "2", "--wait", "120")
        for name, start in BOOMS.items()
    ]
    assert [player.end() for player in players] == [0, 0], [player.said() for player in players]
    told = [player.said() for player in players]
    assert all("\r" not in said and said.count("playing") == 1 for said in told), told  # a bar is for terminals
    for name in BOOMS:
        all_stored(graph, name)
    found: dict[str, Any] = {"access": {name: access(graph, name) for name in NODES}}
    for name, node in nodes.items():
        found[name] = folder / name, PAGE.search(node.wait_for("open http://"))[1]  # type: ignore[index]
        with urlopen(found[name][1], timeout=60.0) as page:
            assert page.status == 200
    for recorder in recorders.values():
        assert recorder.stop(signal.SIGINT) == 0, recorder.said()
    found["access"]["boom_twin_player"] = access_of_player(graph, spawn(command, "play", str(reliable_bag), *SLOWLY))
    graph.destroy_node()
    for node in nodes.values():
        assert node.stop(signal.SIGINT) == 0, node.said()
    return found


def access_of_player(graph: Any, player: Any) -> Access:
    """Of one that plays for long enough to be discovered whole, which takes a while on a busy machine.

    It has a namespace of its own: a player that has ended may still be seen, and would be asked about in its place.
    """
    found: Access = {}
    end = time.monotonic() + 120.0
    while time.monotonic() < end and len(found.get("topics publish", ())) < len(PLAYED):
        time.sleep(0.2)
        found = access(graph, "boom_twin_player", ALONE)
    player.stop(signal.SIGINT)
    return found


Access = dict[str, set[str]]


def access(graph: Any, name: str, namespace: str = "/front") -> Access:
    """What a node publishes, hears, answers and asks, by the words of a policy as if in /front; {} if it is not there."""
    queries = {
        "topics publish": graph.get_publisher_names_and_types_by_node,
        "topics subscribe": graph.get_subscriber_names_and_types_by_node,
        "services reply": graph.get_service_names_and_types_by_node,
        "services request": graph.get_client_names_and_types_by_node,
    }
    try:
        found = {verb: [each for each, _ in query(name, namespace)] for verb, query in queries.items()}
        return {verb: {each.replace(f"{namespace}/", "/front/") for each in names} for verb, names in found.items()}
    except NodeNameNonExistentError:
        return {}


def allowed(profile: Element) -> Access:
    """The same by the policy, for a node in /front."""
    own = f"/front/{profile.attrib['node']}"
    shared = {"rosout", "parameter_events", "diagnostics", "clock"}

    def full(name: str) -> str:
        return f"{own}/{name[2:]}" if name.startswith("~/") else f"/{name}" if name in shared else f"/front/{name}"

    verbs = ("topics publish", "topics subscribe", "services reply", "services request")
    return {
        verb: {
            full(str(each.text))
            for group in profile.findall(f"{verb.split()[0]}[@{verb.split()[1]}='ALLOW']")
            for each in group
        }
        for verb in verbs
    }


def test_the_policy_allows_what_the_processes_do_and_no_more(recorded: dict[str, Any]) -> None:
    profiles = {each.attrib["node"]: each for each in ElementTree.parse(CONFIG / "sros2_policy.xml").getroot().iter("profile")}
    assert profiles.keys() == recorded["access"].keys()
    for node, done in recorded["access"].items():
        permitted = allowed(profiles[node])
        assert done, node
        for verb, names in done.items():
            assert names <= permitted[verb], (node, verb, sorted(names - permitted[verb]))
            assert permitted[verb] - names <= OPTIONAL, (node, verb, sorted(permitted[verb] - names))


def test_each_has_its_own_names_frames_page_and_motion(recorded: dict[str, Any]) -> None:
    tips = []
    for name in BOOMS:
        session, topics = scan(recorded[name][0]), mapping_of(recorded[name][0]).topics
        names = {topic.name for topic in session.topics if topic.count}
        assert {each.split("/")[1] for each in names} == {name, "diagnostics"} and f"/{name}/boom_twin/shape" in names
        assert topics.frame == f"{name}/base_link"
        for key in (Output.TIP_POSITION, Output.ESTIMATE_POSE, Output.HEALTH, Output.CHANGES, Output.SHAPE):
            for _, _, msg in read(session, {topics.outputs[key].absolute: TYPES[key]}):
                assert {each.header.frame_id for each in getattr(msg, "markers", [msg])} == {topics.frame}
        tips.append(dict(published(recorded[name][0], topics, Output.TIP_POSITION)))
        replay(recorded[name][0], None, recorded[name][0].with_name(f"{name}_out"))
        assert published(recorded[name][0].with_name(f"{name}_out") / "bag", topics, Output.TIP_POSITION) == [*tips[-1].items()]
    assert recorded["front"][1] != recorded["rear"][1]
    assert tips[0].keys() > tips[1].keys() and len(tips[1]) > 100


def test_every_status_tells_of_which_boom_it_is(recorded: dict[str, Any]) -> None:
    session = scan(recorded["front"][0])
    told = [status for _, _, msg in read(session, {"/diagnostics": TYPES[Output.DIAGNOSTICS]}) for status in msg.status]
    assert {status.hardware_id for status in told} >= {"front/boom_twin", "rear/boom_twin"}
    assert all(status.name.startswith(f"{status.hardware_id}: ") for status in told)
    analyzers = YAML(typ="safe").load((CONFIG / "analyzers.yaml").read_text())["analyzers"]["ros__parameters"]
    words = {name: each["contains"] for name, each in analyzers.items() if isinstance(each, dict)}
    for status in told:  # as diagnostic_aggregator's GenericAnalyzer matches
        found = [name for name, parts in words.items() if any(part in status.name for part in parts)]
        assert len(found) == 1, (status.name, found)
