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
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import NodeNameNonExistentError
from ruamel.yaml import YAML

import boom_twin
from boom_twin.bag.reader import read, read_both, scan
from boom_twin.bag.session_model import mapping_of
from boom_twin.bag.writer import SessionWriter
from boom_twin.messages.mapping import load_mapping
from boom_twin.messages.report_encoder import decode_health
from boom_twin.messages.sample_decoder import stamp_of
from boom_twin.messages.topic_table import TYPES, Output, Topics
from boom_twin.messages.type_store import jazzy
from boom_twin.offline.replay import replay
from boom_twin.ros.bag.recorder import COMPLETE
from boom_twin.ros.runtime import message_class, qos_profile
from boom_twin.types import Stream

BOOMS = {"front": "0.0", "rear": "1.0"}
"""Their namespaces, and from when on the session is played to each, s."""
COMPARED = [key for key in Output if key not in (Output.DIAGNOSTICS, Output.RESIDUALS)]
ORDERED = tuple(output for output in Output if output.startswith("estimate_"))
"""What depends on the order in which samples of several streams are taken. Where DDS sends a lost packet again, to the recorder
or to the node, the two have not seen the same order; that their bits are equal where they have is for `test_ros_live`. Here the
recording is brought into the order of its stamps: angles 2 s behind the strokes are a dropout of their sensors."""
JUDGED = (Output.HEALTH, Output.TIP_UNCERTAINTY)
"""Told when there is news, or after a second; an overloaded node leaves out looks, a replay none."""
NODES = ("boom_twin", "boom_twin_recorder", "boom_twin_monitor")
ALONE = "/alone"
SLOWLY = ("--namespace", ALONE.strip("/"), "--rate", "0.01", "--wait", "0")
PLAYED = ("cylinder_strokes", "joint_angles", "tip_imu", "rosout", "parameter_events")
RARE = (Output.CHANGES, Output.HEALTH, Output.TIP_UNCERTAINTY, Output.SHAPE)
CONFIG = Path(boom_twin.__file__).parent / "msg_config"
OPTIONAL = {"/front/cylinder_forces", "/clock", "/front/boom_twin/baseline"}
"""What there is with forces in the session, with --clock, with a baseline of one's own."""
MAPPING = "inputs:\n" + "".join(
    f"  {stream.value}: {{qos: {{reliability: reliable, durability: transient_local}}}}\n" for stream in Stream
)
"""So that a busy machine loses nothing on the way to node or recorder, though they may find the player late."""
PAGE = re.compile(r"open (http://127\.0\.0\.1:\d+/)")


@pytest.fixture(scope="module")
def recorded(spawn: Callable[..., Any], spawn_node: Callable[..., Any], bag: Path, tmp_path_factory: Any) -> dict[str, Any]:
    """By boom its recording and the address of its page."""
    folder = tmp_path_factory.mktemp("booms")
    mapping, played = folder / "mapping.yaml", folder / "played"
    mapping.write_text(MAPPING)
    inputs = {topic.absolute: topic for topic in load_mapping(mapping).inputs.values()}
    with SessionWriter(played, inputs) as writer:
        types = {name: topic.type for name, topic in inputs.items() if scan(bag).find(name) is not None}
        for name, log, data, _ in read_both(scan(bag), types):
            writer.write_encoded(name, log, data)
    nodes = {
        name: spawn_node(
            "-r", f"__ns:=/{name}", "-p", f"frame_prefix:={name}/", "-p", "monitor:=true", "-p", f"mapping:={mapping}"
        )
        for name in BOOMS
    }
    for name, node in nodes.items():
        node.wait_for(f"listening to /{name}/cylinder_strokes")
    command = "boom_twin.cli.main"
    recorders = {
        name: spawn(command, "record", "--out", str(folder / name), "--mapping", str(mapping), "--namespace", name)
        for name in BOOMS
    }
    graph = rclpy.create_node("graph")
    silent = [
        graph.create_publisher(message_class(topic.type), f"/{name}{topic.absolute}", qos_profile(topic.qos))
        for name in BOOMS
        for topic in inputs.values()
    ]
    for recorder in recorders.values():  # it hears all of the node, which it may have found late
        recorder.wait_for(COMPLETE)
    for publisher in silent:
        graph.destroy_publisher(publisher)
    patience = ("--listeners", "2", "--wait", "120")
    options = {name: ("--namespace", name, "--start", start, *patience) for name, start in BOOMS.items()}
    players = [spawn(command, "play", str(played), *options[name]) for name in BOOMS]
    assert [player.end() for player in players] == [0, 0], [player.said() for player in players]
    told = [player.said() for player in players]
    assert all("\r" not in said and said.count("playing") == 1 for said in told), told  # a bar is for terminals
    for name, player in zip(BOOMS, players, strict=True):
        sent = re.search(r"cylinder_strokes (\d+)", player.said())[1]  # type: ignore[index]
        wait_for_all(graph, name, sent)
    found: dict[str, Any] = {"access": {name: access(graph, name) for name in NODES}}
    for name, node in nodes.items():
        node.wait_for("open http://")
        found[name] = (folder / name, PAGE.search(node.said())[1])  # type: ignore[index]
        with urlopen(found[name][1], timeout=60.0) as page:
            assert page.status == 200
    for recorder in recorders.values():
        assert recorder.stop(signal.SIGINT) == 0, recorder.said()
    found["access"]["boom_twin_player"] = access_of_player(graph, spawn(command, "play", str(played), *SLOWLY))
    graph.destroy_node()
    for node in nodes.values():
        assert node.stop(signal.SIGINT) == 0, node.said()
    return found


def access_of_player(graph: Any, player: Any) -> Access:
    """Of one that plays for long enough to be discovered whole, which takes a while on a busy machine.

    It has a namespace of its own: a player that has ended may still be seen, and would be asked about in its place.
    """
    found: Access = {}
    end = time.monotonic() + 60.0
    while time.monotonic() < end and len(found.get("topics publish", ())) < len(PLAYED):
        time.sleep(0.2)
        found = access(graph, "boom_twin_player", ALONE)
    player.stop(signal.SIGINT)
    return found


def wait_for_all(graph: Any, name: str, sent: str) -> None:
    """Until a recorder has all strokes, and for a while no more of what the node makes of them, by its own words."""
    heard: list[dict[str, str]] = []

    def hear(msg: DiagnosticArray) -> None:
        found = [status for status in msg.status if status.name == f"{name}/boom_twin_recorder: recording"]
        values = [
            {pair.key: pair.value for pair in status.values if pair.key.startswith(f"received /{name}/")} for status in found
        ]
        heard.extend(values)

    subscription = graph.create_subscription(DiagnosticArray, "/diagnostics", hear, 100)
    end = time.monotonic() + 120.0
    while len(heard) < 4 or heard[-1] != heard[-4] or heard[-1][f"received /{name}/cylinder_strokes"] != sent:
        assert time.monotonic() < end, (sent, heard[-4:])
        rclpy.spin_once(graph, timeout_sec=0.1)
    graph.destroy_subscription(subscription)


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


def published(path: Path, topics: Topics, key: Output) -> list[tuple[int, bytes]]:
    """Stamp and CDR of every message of one output; encoded anew, because rclpy does not clear the bytes between values."""
    found = [msg for _, _, msg in read(scan(path), {topics.outputs[key].absolute: TYPES[key]})]
    holders = [msg.markers[0] if key is Output.SHAPE else msg for msg in found]
    return [(stamp_of(each), bytes(jazzy().serialize_cdr(msg, TYPES[key]))) for each, msg in zip(holders, found, strict=True)]


def causes(path: Path, topics: Topics) -> set[str | None]:
    """All that health named."""
    found = read(scan(path), {topics.outputs[Output.HEALTH].absolute: TYPES[Output.HEALTH]})
    return {alarm.cause for _, _, msg in found for alarm in decode_health(msg)}


@pytest.mark.parametrize("name", BOOMS)
def test_its_recording_replays_to_what_its_node_published(recorded: dict[str, Any], name: str, tmp_path: Path) -> None:
    """Bit for bit, of the strokes that the node answered; what depends on the order of arrival has its stamps."""
    path = recorded[name][0]
    topics = mapping_of(path).topics
    answered = {stamp for stamp, _ in published(path, topics, Output.TIP_POSITION)}
    inputs = {topic.absolute: stream for stream, topic in topics.inputs.items() if stream is not Stream.FORCES}  # none is sent
    session = scan(path)
    with SessionWriter(tmp_path / "bag", {stream.value: topic for stream, topic in topics.inputs.items()}) as writer:
        rows = [*read_both(session, {each: TYPES[stream] for each, stream in inputs.items()})]
        for log, (topic, _, data, msg) in zip(
            [row[1] for row in rows], sorted(rows, key=lambda row: stamp_of(row[3])), strict=True
        ):
            if inputs[topic] is not Stream.STROKES or stamp_of(msg) in answered:
                writer.write_encoded(inputs[topic].value, log, data)
    (tmp_path / "bag" / "session.yaml").write_text((path / "session.yaml").read_text())
    replay(tmp_path / "bag", None, tmp_path / "out")
    for key in COMPARED:
        live = published(path, topics, key)
        assert len(live) > (0 if key in RARE else 100)
        replayed = published(tmp_path / "out" / "bag", topics, key)
        if key in JUDGED:
            assert causes(tmp_path / "out" / "bag", topics) <= {"tip_imu.sensor"}  # whose readings are made up
        elif key in ORDERED:
            assert [stamp for stamp, _ in live] == [stamp for stamp, _ in replayed], key
        else:
            assert live == replayed, key


@pytest.mark.parametrize("name", BOOMS)
def test_names_and_frames_are_its_own(recorded: dict[str, Any], name: str) -> None:
    session, topics = scan(recorded[name][0]), mapping_of(recorded[name][0]).topics
    names = {topic.name for topic in session.topics if topic.count}
    assert {each.split("/")[1] for each in names} == {name, "diagnostics"} and f"/{name}/boom_twin/shape" in names
    assert topics.frame == f"{name}/base_link"
    for key in (Output.TIP_POSITION, Output.ESTIMATE_POSE, Output.HEALTH, Output.CHANGES):
        found = read(session, {topics.outputs[key].absolute: TYPES[key]})
        assert {msg.header.frame_id for _, _, msg in found} == {topics.frame}
    shapes = read(session, {topics.outputs[Output.SHAPE].absolute: TYPES[Output.SHAPE]})
    assert {marker.header.frame_id for _, _, msg in shapes for marker in msg.markers} == {topics.frame}


def test_the_two_are_told_apart(recorded: dict[str, Any]) -> None:
    """Different pages, different motions, and in every status which boom it is of."""
    (front, one), (rear, other) = recorded["front"], recorded["rear"]
    assert one != other
    tips = [dict(published(path, mapping_of(path).topics, Output.TIP_POSITION)) for path in (front, rear)]
    shared = tips[0].keys() & tips[1].keys()
    assert shared and len(tips[0]) > len(tips[1])
    told = [status for _, _, msg in read(scan(front), {"/diagnostics": TYPES[Output.DIAGNOSTICS]}) for status in msg.status]
    assert {status.hardware_id for status in told} >= {"front/boom_twin", "rear/boom_twin"}
    assert all(status.name.startswith(f"{status.hardware_id}: ") for status in told)
    analyzers = YAML(typ="safe").load((CONFIG / "analyzers.yaml").read_text())["analyzers"]["ros__parameters"]
    words = {name: each["contains"] for name, each in analyzers.items() if isinstance(each, dict)}
    for status in told:  # as diagnostic_aggregator's GenericAnalyzer matches
        found = [name for name, parts in words.items() if any(part in status.name for part in parts)]
        assert len(found) == 1, (status.name, found)
