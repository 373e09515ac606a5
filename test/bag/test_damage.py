"""Sessions that are damaged, cut off, or something else: refused by name, never read wrongly."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import main
from fuzz.mcap_files import VARIANTS, joined, records
from mcap.opcode import Opcode
from mcap.writer import IndexType
from recordings import FILE_NAME, MessageWriter, Session, read, scan
from ros_messages import load_topics

from boom_twin import BagError, Stream

Content = Callable[[Session], list[tuple[Any, ...]]]
JOINT_STATE = "sensor_msgs/msg/JointState"
IDL = b"module sensor_msgs { module msg { struct JointState { sequence<float> position; }; }; };"


def refusal(path: Path, content: Content) -> str:
    with pytest.raises(BagError) as caught:
        content(scan(path))
    return str(caught.value)


@pytest.mark.parametrize("variant", sorted(VARIANTS.keys() - {"unchecked"}))
def test_a_flipped_bit_is_never_read_as_data(bag: Path, rewritten: Callable[..., Path], variant: str, content: Content) -> None:
    path = rewritten(bag, **VARIANTS[variant])
    truth, whole = content(scan(path)), path.read_bytes()
    random, refused = np.random.default_rng(11), 0
    for place, bit in zip(random.integers(0, len(whole), 60), random.integers(0, 8, 60), strict=True):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(bit)
        path.write_bytes(damaged)
        try:
            found = content(scan(path))
        except BagError as error:
            assert str(path) in str(error)
            refused += 1
        else:
            assert found == truth, f"bit {bit} of byte {place}"
    assert refused > 10


@pytest.mark.parametrize("kept", [0, 5, 8, 30, 1000, 0.5, 0.9, -100, -1])
def test_a_file_cut_off_is_refused_by_name_with_its_remedy(
    bag: Path, kept: float, content: Content, capsys: pytest.CaptureFixture[str]
) -> None:
    file = bag / FILE_NAME
    whole = file.read_bytes()
    file.write_bytes(whole[: int(kept * len(whole)) if isinstance(kept, float) else kept])
    message = refusal(bag, content)
    assert str(file) in message and ("boom_twin recover" in message or kept in (0, 5))
    assert main(["info", str(bag)]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_counts_are_compared(bag: Path, content: Content) -> None:
    session, metadata = scan(bag), bag / "metadata.yaml"
    for old, new, told in (
        ("message_count: 40", "message_count: 41", ["/cylinder_strokes: metadata.yaml 41, files 40"]),
        ("name: /tip_imu", "name: /imu", ["/imu: metadata.yaml 40, files 0", "/tip_imu: metadata.yaml 0, files 40"]),
    ):
        text = metadata.read_text()
        metadata.write_text(text.replace(old, new, 1))
        message = refusal(bag, content)
        assert all(words in message for words in told)
        metadata.write_text(text)
    file = session.files[0]
    file.counts[next(iter(file.counts))] += 1
    with pytest.raises(BagError, match="statistics 41, read 40"):
        content(session)


def test_a_topic_that_is_not_there_or_of_another_type_is_refused(bag: Path) -> None:
    with pytest.raises(BagError, match=r"no topic joint_angels;.*/cylinder_strokes, .* If /joint_angles is that topic"):
        read(scan(bag), {"joint_angels": JOINT_STATE})
    with pytest.raises(BagError, match="/tip_imu has type 'sensor_msgs/msg/Imu', not sensor_msgs/msg/JointState"):
        read(scan(bag), {"tip_imu": JOINT_STATE})


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"profile": "ros1"}, "profile = 'ros1'"),
        ({"encoding": "json"}, "message encoding 'json'"),
        ({"schema_encoding": "jsonschema"}, "schema encoding 'jsonschema'"),
        ({"change": lambda text: text.replace(b"float64[] velocity", b"float32[] velocity")}, "defined otherwise"),
        ({"change": lambda text: b"} no definition {"}, "cannot be parsed"),
        ({"schema_encoding": "ros2idl", "change": lambda text: IDL}, "defined otherwise"),
    ],
)
def test_what_is_not_ros2_is_refused(
    bag: Path, rewritten: Callable[..., Path], options: dict[str, Any], words: str, content: Content
) -> None:
    path = rewritten(bag, **options)
    message = refusal(path, content)
    assert words in message and str(path) in message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("storage_identifier: mcap", "storage_identifier: rocksdb", "storage_identifier = 'rocksdb'"),
        ("compression_mode: ''", "compression_mode: FILE", "compression_mode = 'FILE'"),
        ("version: 9", "version: nine", "version: Input should be a valid integer"),
        ("rosbag2_bagfile_information:", "other:", "not rosbag2 metadata"),
        ("rosbag2_bagfile_information:", "{", "not a readable YAML file"),
        ("- session_0.mcap", "- session_1.mcap", "session_1.mcap: cannot be read (No such file"),
    ],
)
def test_metadata_that_cannot_be_used_is_refused(bag: Path, old: str, new: str, words: str, content: Content) -> None:
    metadata = bag / "metadata.yaml"
    assert old in metadata.read_text()
    metadata.write_text(metadata.read_text().replace(old, new))
    assert words in refusal(bag, content)


def test_a_file_that_the_metadata_does_not_name_is_refused(bag: Path, content: Content) -> None:
    shutil.copy(bag / FILE_NAME, bag / "session_1.mcap")
    assert "metadata.yaml does not name session_1.mcap: the recorder was ended by force" in refusal(bag, content)


def test_nothing_there(tmp_path: Path, content: Content) -> None:
    assert "no such file or directory" in refusal(tmp_path / "none", content)
    (tmp_path / "notes.txt").write_text("x")
    assert "no .mcap or .db3 file and no metadata.yaml in it (there is: notes.txt)" in refusal(tmp_path, content)
    shutil.copy(tmp_path / "notes.txt", tmp_path / "notes.mcap")
    assert "not an MCAP file" in refusal(tmp_path, content)


@pytest.mark.parametrize("data", [b"", b"\x00\x01\x00\x00\x05", b"\x00\x01\x00\x00" + bytes(500)])
def test_a_message_that_cannot_be_decoded_is_named(tmp_path: Path, data: bytes) -> None:
    topic = load_topics().inputs[Stream.STROKES]
    with MessageWriter(tmp_path / "bag", {"strokes": topic}) as bag:
        bag.write_encoded("strokes", 77, data)
    with pytest.raises(BagError, match=r"session_0\.mcap: topic /cylinder_strokes at log time 77 ns"):
        list(read(scan(tmp_path / "bag"), {"cylinder_strokes": JOINT_STATE}))


@pytest.mark.parametrize("options", [{}, {"index_types": IndexType.NONE}], ids=["indexed", "unindexed"])
def test_one_chunk_without_a_checksum_is_told(bag: Path, rewritten: Callable[..., Path], options: dict[str, Any]) -> None:
    """The others' do not vouch for it."""
    path = rewritten(bag, **options)
    assert scan(path).checked
    found = records(path.read_bytes())
    place = [number for number, (opcode, _) in enumerate(found) if opcode == Opcode.CHUNK][2]
    body = found[place][1]
    found[place] = (int(Opcode.CHUNK), body[:24] + bytes(4) + body[28:])
    path.write_bytes(joined(found))
    assert not scan(path).checked
