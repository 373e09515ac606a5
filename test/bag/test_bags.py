"""Sessions written and read again: here, by rosbags, by the plain mcap reader."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import MCAP0_MAGIC, IndexType
from recordings import FILE_NAME, MessageWriter, Session, read, read_metadata, recover, scan, write_metadata, write_session
from ros_messages import Qos, Topic, jazzy, load_topics, new_message, stamp_of
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag2 import Reader
from ruamel.yaml import YAML

from boom_twin import BagError, Stream
from boom_twin.bag.inspect import inspect

Content = Callable[[Session], list[tuple[Any, ...]]]
POINT = Topic(
    name="~/tip/position",
    type="geometry_msgs/msg/PointStamped",
    qos=Qos(reliability="reliable", durability="transient_local", depth=7),
    unit="m",
    meaning="a point",
)


def write_points(directory: Path, count: int) -> None:
    with MessageWriter(directory, {"point": POINT}, {"origin": "synthetic"}) as bag:
        for number in range(count):
            msg = new_message(POINT.type)
            msg.point.x = float(number)
            bag.write("point", 10 * number, msg)


def test_what_is_written_is_read(bag: Path, arrays: dict[str, Any], wanted: dict[str, str]) -> None:
    session = scan(bag)
    assert {topic.name: topic.count for topic in session.topics} == {
        "/cylinder_strokes": 40,
        "/joint_angles": 40,
        "/tip_imu": 40,
    }
    assert (session.start, session.end) == (arrays["stamps_ns"][0], arrays["stamps_ns"][-1])
    assert session.notes == {"origin": "synthetic, made for a test"} and session.checked
    assert session.find("tip_imu") == session.find("/tip_imu") == session.topics[2] and session.find("imu") is None
    found = list(read(session, wanted))
    rows = {name: [msg for topic, _, msg in found if topic == name] for name in wanted}
    assert [time for _, time, _ in found] == np.repeat(arrays["stamps_ns"], 3).tolist()
    assert [name for name, _, _ in found[:3]] == ["cylinder_strokes", "joint_angles", "tip_imu"]
    np.testing.assert_array_equal([msg.position for msg in rows["cylinder_strokes"]], arrays["strokes"])
    np.testing.assert_array_equal([msg.position for msg in rows["joint_angles"]], arrays["joints"])
    forces = [(msg.linear_acceleration.x, msg.linear_acceleration.z) for msg in rows["tip_imu"]]
    np.testing.assert_array_equal(forces, arrays["imu"])
    assert rows["joint_angles"][5].name == ["joint_1", "joint_2", "joint_3"]
    stamps = [stamp_of(msg) for msg in rows["tip_imu"]]
    assert stamps == arrays["stamps_ns"].tolist()


def test_rosbags_and_the_package_read_it(tmp_path: Path) -> None:
    write_points(tmp_path / "bag", 3000)
    with Reader(tmp_path / "bag") as reader:
        (connection,) = reader.connections
        assert (reader.message_count, reader.duration) == (3000, 29_991)
        assert (connection.topic, connection.msgtype) == ("/boom_twin/tip/position", POINT.type)
        assert connection.digest == jazzy().hash_rihs01(POINT.type)
        (qos,) = connection.ext.offered_qos_profiles
        assert qos.reliability is QosReliability.RELIABLE and qos.durability is QosDurability.TRANSIENT_LOCAL
        assert qos.depth == 7
    with AnyReader([tmp_path / "bag"]) as reader:
        found = [reader.deserialize(raw, POINT.type).point.x for _, _, raw in reader.messages()]
    assert found == list(range(3000))
    session = scan(tmp_path / "bag")
    assert len(session.files[0].pieces) > 2
    assert [msg.point.x for _, _, msg in read(session, {"/boom_twin/tip/position": POINT.type})] == found


def test_file_is_as_the_contract_says(bag: Path) -> None:
    with (bag / FILE_NAME).open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        header, summary = reader.get_header(), reader.get_summary()
        notes = list(reader.iter_metadata())
    assert (header.profile, header.library) == ("ros2", "boom_twin")
    assert summary is not None
    assert {schema.encoding for schema in summary.schemas.values()} == {"ros2msg"}
    assert {channel.message_encoding for channel in summary.channels.values()} == {"cdr"}
    definition = next(schema.data.decode() for schema in summary.schemas.values() if "Joint" in schema.name)
    assert "MSG: std_msgs/Header" in definition and "MSG: builtin_interfaces/Time" in definition
    assert [(record.name, record.metadata) for record in notes] == [("boom_twin", {"origin": "synthetic, made for a test"})]
    root = YAML(typ="safe").load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert (root["version"], root["storage_identifier"], root["ros_distro"]) == (9, "mcap", "jazzy")
    assert root["custom_data"] == {"origin": "synthetic, made for a test"}
    qos = root["topics_with_message_count"][0]["topic_metadata"]["offered_qos_profiles"][0]
    assert (qos["reliability"], qos["durability"], qos["history"]) == ("best_effort", "volatile", "keep_last")


def test_a_run_that_fails_leaves_no_bag_that_looks_whole(tmp_path: Path) -> None:
    """What was written can be saved."""
    with pytest.raises(ZeroDivisionError), MessageWriter(tmp_path / "bag", {"point": POINT}) as bag:
        bag.write("point", 1, new_message(POINT.type))
        raise ZeroDivisionError
    assert not (tmp_path / "bag" / "metadata.yaml").exists()
    with pytest.raises(BagError, match="incomplete: the end is missing"):
        scan(tmp_path / "bag")
    recover(tmp_path / "bag", tmp_path / "saved")
    assert scan(tmp_path / "saved").find("/boom_twin/tip/position").count == 1


def test_nothing_is_overwritten(bag: Path, arrays: dict[str, Any]) -> None:
    before = (bag / FILE_NAME).read_bytes()
    with pytest.raises(BagError, match=r"holds metadata\.yaml already"):
        write_session(bag, **arrays, description={})
    assert (bag / FILE_NAME).read_bytes() == before


def test_an_empty_bag_is_whole_but_its_topic_is_refused(tmp_path: Path) -> None:
    with MessageWriter(tmp_path / "bag", {"strokes": load_topics().inputs[Stream.STROKES]}):
        pass
    session = scan(tmp_path / "bag")
    assert [(topic.name, topic.count) for topic in session.topics] == [("/cylinder_strokes", 0)]
    with pytest.raises(BagError, match="no messages"):
        read(session, {"cylinder_strokes": "sensor_msgs/msg/JointState"})


def test_bare_file_and_directory_without_metadata(bag: Path, content: Content) -> None:
    whole = content(scan(bag))
    assert content(scan(bag / FILE_NAME)) == whole
    (bag / "metadata.yaml").unlink()
    session = scan(bag)
    assert content(session) == whole
    assert session.notes == {"origin": "synthetic, made for a test"}


def test_files_without_metadata_are_in_the_order_of_their_numbers(bag: Path, tmp_path: Path) -> None:
    (tmp_path / "split").mkdir()
    for number in (10, 9, 2):
        (tmp_path / "split" / f"s_{number}.mcap").write_bytes((bag / FILE_NAME).read_bytes())
    assert [file.path.name for file in scan(tmp_path / "split").files] == ["s_2.mcap", "s_9.mcap", "s_10.mcap"]


def test_split_files_are_merged_by_time(tmp_path: Path, arrays: dict[str, Any], bag: Path, content: Content) -> None:
    cuts = {"late": slice(25, None), "early": slice(None, 25)}
    (tmp_path / "split").mkdir()
    metadata = read_metadata(bag / "metadata.yaml")
    for name, cut in cuts.items():
        write_session(tmp_path / name, **{key: value[cut] for key, value in arrays.items()}, description={})
        (tmp_path / name / FILE_NAME).rename(tmp_path / "split" / f"{name}.mcap")
    write_metadata(
        tmp_path / "split" / "metadata.yaml",
        metadata.model_copy(update={"relative_file_paths": [f"{name}.mcap" for name in cuts]}),
    )
    assert content(scan(tmp_path / "split")) == content(scan(bag))


LACKING: dict[str, dict[str, Any]] = {
    "no message index": {"index_types": IndexType.CHUNK},
    "no index": {"index_types": IndexType.NONE},
    "no summary": {
        "index_types": IndexType.NONE,
        "use_statistics": False,
        "use_summary_offsets": False,
        "repeat_channels": False,
        "repeat_schemas": False,
    },
    "no repeated channels": {"repeat_channels": False, "repeat_schemas": False},
    "no chunks": {"use_chunking": False, "enable_data_crcs": True},
    "no checksums": {"enable_crcs": False},
}


@pytest.mark.parametrize("what", LACKING)
def test_files_that_lack_something_are_read_fully(
    bag: Path, rewritten: Callable[..., Path], what: str, content: Content
) -> None:
    path = rewritten(bag, **LACKING[what])
    assert content(scan(path)) == content(scan(bag))
    assert [(each.count, each.gap) for each in inspect(path).tallies] == [
        (each.count, each.gap) for each in inspect(bag).tallies
    ]


@pytest.mark.parametrize("is_chunked", [False, True])
def test_records_that_an_application_defined_for_itself_are_skipped(
    bag: Path, rewritten: Callable[..., Path], is_chunked: bool, content: Content
) -> None:
    """Behind the header, before the first chunk or schema: opcode 0x80, 5 bytes."""
    path = rewritten(bag, **LACKING["no summary"], use_chunking=is_chunked)
    (file,) = path.glob("*.mcap") if path.is_dir() else (path,)
    raw = file.read_bytes()
    behind = len(MCAP0_MAGIC) + 9 + int.from_bytes(raw[len(MCAP0_MAGIC) + 1 :][:8], "little")
    file.write_bytes(raw[:behind] + b"\x80" + (5).to_bytes(8, "little") + b"\xff" * 5 + raw[behind:])
    assert content(scan(path)) == content(scan(bag))


@pytest.mark.parametrize("options", [{}, {"use_chunking": False}], ids=["indexed", "unindexed"])
def test_messages_come_by_time_whatever_their_order_in_the_file(
    bag: Path, rewritten: Callable[..., Path], options: dict[str, Any], content: Content
) -> None:
    found = content(scan(rewritten(bag, backwards=True, **options)))
    assert [entry[1] for entry in found] == sorted(entry[1] for entry in found)
    assert sorted(found, key=str) == sorted(content(scan(bag)), key=str)
