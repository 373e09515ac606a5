"""Bags of other recorders that are sound: other names, definitions, profiles and topics than the package writes."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import zstandard
from command import main
from fuzz.mcap_files import Entry, write
from mcap.reader import make_reader
from recordings import FILE_NAME, Session, read, scan
from ros_messages import jazzy

from boom_twin import BagError

Content = Callable[[Session], list[tuple[Any, ...]]]
JOINT_STATE, IMU = "sensor_msgs/msg/JointState", "sensor_msgs/msg/Imu"
IDL = b"""module sensor_msgs { module msg { struct JointState { std_msgs::msg::Header header; sequence<string> name;
sequence<double> position; sequence<double> velocity; sequence<double> effort; }; }; };"""


def messages(bag: Path) -> list[Entry]:
    with (bag / FILE_NAME).open("rb") as file:
        return [(c.topic, s.name, "cdr", m.log_time, m.data) for s, c, m in make_reader(file).iter_messages() if s]


DEFINITIONS: dict[str, dict[str, Any]] = {
    "none": {"schema_encoding": "", "change": lambda text: b""},
    "idl": {"schema_encoding": "ros2idl", "change": lambda text: IDL},
    "carriage returns": {"change": lambda text: text.replace(b"\n", b"\r\n")},
    "byte order mark": {"change": lambda text: b"\xef\xbb\xbf" + text},
    "latin-1": {"change": lambda text: b"# \xfcber\n" + text},
    "short separators": {"change": lambda text: re.sub(rb"={10,}", b"===  ", text)},
    "no profile": {"profile": ""},
}


@pytest.mark.parametrize("kind", DEFINITIONS)
def test_a_definition_is_read_however_it_is_written(
    bag: Path, rewritten: Callable[..., Path], content: Content, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = rewritten(bag, **DEFINITIONS[kind])
    assert content(scan(path)) == content(scan(bag))
    assert main(["info", str(path)]) == 0
    assert re.search(r"/cylinder_strokes +sensor_msgs/msg/JointState +40 .* 0.000 +0.000 +0.000\n", capsys.readouterr().out)


NAMES: dict[str, Callable[[str], str]] = {
    "two parts": lambda kind: kind.replace("/msg/", "/"),
    "c++": lambda kind: kind.replace("/", "::"),
    "dds": lambda kind: kind.replace("/msg/", "::msg::dds_::") + "_",
}


@pytest.mark.parametrize("kind", NAMES)
def test_types_are_known_by_their_other_names(bag: Path, tmp_path: Path, content: Content, kind: str) -> None:
    path = write(tmp_path / "other.mcap", messages(bag), NAMES[kind])
    assert content(scan(path)) == content(scan(bag))


def test_what_is_of_another_type_or_encoding_is_passed_over(
    bag: Path, tmp_path: Path, content: Content, capsys: pytest.CaptureFixture[str]
) -> None:
    entries = messages(bag)
    log = entries[0][3] + 1
    text = bytes(jazzy().serialize_cdr(jazzy().types["std_msgs/msg/String"](data="a"), "std_msgs/msg/String"))
    others = [("/tip_imu", IMU, "json", b"{}"), ("/cylinder_strokes", "std_msgs/msg/String", "cdr", text)]
    others += [("/debug", kind, "cdr", text) for kind in ("std_msgs/msg/String", "std_msgs/msg/Float64")]
    path = write(tmp_path / "two.mcap", entries + [(topic, kind, code, log, data) for topic, kind, code, data in others])
    assert content(scan(path)) == content(scan(bag))
    assert main(["info", str(path)]) == 0
    said = capsys.readouterr().out
    assert "/tip_imu: 1 messages of two.mcap are sensor_msgs/msg/Imu in json and are passed over." in said
    assert "/cylinder_strokes: 1 messages of two.mcap are std_msgs/msg/String in cdr and are passed over." in said
    assert "no header.stamp" not in said and "std_msgs/msg/String and std_msgs/msg/Float64" in said


@pytest.mark.parametrize("chunk", [pytest.param(2**16, marks=pytest.mark.slow), 2**30], ids=["small chunks", "one chunk"])
def test_large_messages_of_other_topics_hold_up_nothing(
    bag: Path, tmp_path: Path, content: Content, chunk: int, capsys: pytest.CaptureFixture[str]
) -> None:
    entries, size = messages(bag), 70 * 2**20
    pictures = [
        ("/camera", "sensor_msgs/msg/Image", "cdr", entries[30][3], data) for data in (bytes(size), b"\1\2" * (size // 2))
    ]
    path = write(tmp_path / "other.mcap", [*entries[:31], *pictures, *entries[31:]], chunk_size=chunk)
    assert content(scan(path)) == content(scan(bag))
    assert main(["info", str(path)]) == main(["recover", str(path), "--out", str(tmp_path / "out")]) == 0
    assert scan(tmp_path / "out").find("/camera").count == 2 and content(scan(tmp_path / "out")) == content(scan(bag))
    assert "damaged" not in (said := capsys.readouterr()).out + said.err


@pytest.mark.parametrize(
    ("old", "new"), [("storage_identifier: mcap", "storage_identifier: ''"), ("- session_0", r"- bag\session_0")]
)
def test_metadata_of_other_systems_is_read(bag: Path, content: Content, old: str, new: str) -> None:
    whole, metadata = content(scan(bag)), bag / "metadata.yaml"
    assert old in metadata.read_text()
    metadata.write_text(metadata.read_text().replace(old, new))
    assert content(scan(bag)) == whole


def test_what_is_packed_as_a_whole_is_read_once_it_is_unpacked(bag: Path, content: Content) -> None:
    whole, metadata, file = content(scan(bag)), bag / "metadata.yaml", bag / FILE_NAME
    unpacked, packed = file.read_bytes(), file.with_name(FILE_NAME + ".zstd")
    file.unlink()
    packed.write_bytes(zstandard.compress(unpacked))
    text = metadata.read_text().replace("compression_mode: ''", "compression_mode: FILE")
    metadata.write_text(text.replace(FILE_NAME, packed.name))
    for path in (bag, packed):
        with pytest.raises(BagError, match=rf"packed as a whole\. Unpack it in its folder: `zstd -d {packed.name}`"):
            scan(path)
    file.write_bytes(unpacked)  # as `zstd -d` does
    assert content(scan(bag)) == whole
    metadata.unlink(), file.unlink()
    with pytest.raises(BagError, match="packed as a whole"):
        scan(bag)


@pytest.mark.parametrize("size", [5000, 10**8])
def test_a_database_whose_messages_are_not_stored_is_refused(tmp_path: Path, size: int) -> None:
    path = tmp_path / "generated.db3"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE topics(id INTEGER, name TEXT, type TEXT, serialization_format TEXT)")
        database.execute(f"INSERT INTO topics VALUES (1, '/cylinder_strokes', '{JOINT_STATE}', 'cdr')")
        columns = f"timestamp INTEGER, data BLOB AS (zeroblob({size}))"
        database.execute(f"CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, {columns})")
        database.executemany("INSERT INTO messages(topic_id, timestamp) VALUES (1, ?)", [(time,) for time in range(100)])
    database.close()
    with pytest.raises(BagError, match=r"generated\.db3: .*(more bytes than the file|too big)"):
        list(read(scan(path), {"cylinder_strokes": JOINT_STATE}))
