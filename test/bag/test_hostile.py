"""Bags from strangers: nothing runs, nothing grows without bound, nothing is written or read outside the folder."""

from __future__ import annotations

import gzip
import os
import shutil
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import lz4.frame
import pytest
import zstandard
from command import main
from mcap.writer import MCAP0_MAGIC
from recordings import METADATA, SESSION_YAML, MessageWriter, read, recover, scan
from ros_messages import load_topics

from boom_twin import BagError, Stream
from boom_twin.bag import mcap_records, session_file
from boom_twin.bag.mcap_records import LARGEST_SUMMARY
from boom_twin.config.yaml_text import plain
from boom_twin.offline import ground_truth as truth

ROOT = Path(__file__).parents[2]
MEGABYTES = 400  # most that a command may take on any of these
JOINT_STATE = "sensor_msgs/msg/JointState"


def laughs(levels: int = 12) -> str:
    rows = ["a0: &a0 [x, x]"]
    return "\n".join([*rows, *(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, levels))])


BOMBS = {
    "laughs": laughs(),
    "merges": "a0: &a0 {x: 1}\n" + "".join(f"a{i}: &a{i}\n  <<: [*a{i - 1}, *a{i - 1}]\n" for i in range(1, 30)),
    "cycle": "&a [*a]",
    "deep": "[" * 1_000_000,
    "list": "- 1\n" * 900_000,
    "digits": "a: " + "9" * 1_000_000,
    "large": "x" * (5 * 2**20),
    "tag": "a: !!python/object/apply:os.mkdir [trap]",
    "name": "a: !!python/name:os.system",
}


def test_yaml_gives_plain_values_of_bounded_size_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in BOMBS.keys() - {"large", "list"}:  # these take seconds; beside a bag they are tested below
        with pytest.raises(ValueError, match=r"more than|nested|limit|tag|kind of key|this is no whole number"):
            plain(BOMBS[name])
    assert not (tmp_path / "trap").exists()
    assert plain("a: 1\nb: [x, .5, 2001-01-01, null, yes, true]") == {"a": 1, "b": ["x", 0.5, "2001-01-01", None, "yes", True]}
    plain("[1]").append(2)
    assert plain("[1]") == [1]
    assert plain("") is None and plain("&a x") == "x" and plain("[&a [1], *a]") == [[1], [1]]


@pytest.mark.parametrize("file", [METADATA, SESSION_YAML])
@pytest.mark.parametrize("bomb", BOMBS)
@pytest.mark.system
def test_a_command_survives_bombs_beside_a_bag(bag: Path, bomb: str, file: str, tmp_path: Path) -> None:
    (bag / file).write_text(BOMBS[bomb])
    words = refused_in_little_memory(tmp_path, "info", bag)
    assert not (tmp_path / "trap").exists() and file in words


MEASURED = """
import re, sys
from boom_twin.cli.main import main
code = main(sys.argv[1:])
print(int(re.search(r"VmHWM:\\s*(\\d+)", open("/proc/self/status").read())[1]) // 1024)
sys.exit(code)
"""


def refused_in_little_memory(folder: Path, *arguments: Any) -> str:
    """Return why a command in a process of its own refused its input. Its peak of memory counts (VmHWM, not ru_maxrss)."""
    options: Any = {"capture_output": True, "text": True, "timeout": 200, "cwd": folder}
    done = subprocess.run([sys.executable, "-c", MEASURED, *arguments], env={**os.environ, "PYTHONPATH": str(ROOT)}, **options)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert int(done.stdout.split()[-1]) < MEGABYTES
    return str(done.stderr)


@pytest.mark.parametrize("name", ["../outside.mcap", "/etc/passwd", "..", ".", "", "a/../../outside.mcap", "x\x00y"])
def test_names_in_metadata_do_not_lead_outside(bag: Path, name: str, tmp_path: Path) -> None:
    """Only the last part of a name counts, and it must be in the folder."""
    shutil.copy(next(bag.glob("*.mcap")), tmp_path / "outside.mcap")
    text = (bag / METADATA).read_text()
    quoted = '"' + name.replace("\x00", "\\0") + '"'
    (bag / METADATA).write_text(text.replace("session_0.mcap", quoted))
    with pytest.raises(BagError):
        scan(bag)


def test_recovery_writes_into_its_folder_alone(bag: Path, tmp_path: Path) -> None:
    text = (bag / METADATA).read_text()
    (bag / METADATA).write_text(text.replace("session_0.mcap", "../../escaped.mcap"))
    (bag / SESSION_YAML).write_text("mapping: ''\n")
    before = set(tmp_path.rglob("*"))
    recover(bag, tmp_path / "out")
    made = {path.relative_to(tmp_path).as_posix() for path in set(tmp_path.rglob("*")) - before}
    assert made == {"out", "out/session_0.mcap", f"out/{METADATA}", f"out/{SESSION_YAML}"}
    assert (tmp_path / "out" / SESSION_YAML).read_text() == "mapping: ''\n"


def write_raw(directory: Path, *bodies: bytes) -> Path:
    with MessageWriter(directory, {"strokes": load_topics().inputs[Stream.STROKES]}) as bag:
        for number, body in enumerate(bodies, start=1):
            bag.write_encoded("strokes", number, body)
    return directory


HEAD = b"\x00\x01\x00\x00" + struct.pack("<iI", 1, 0) + struct.pack("<I", 1) + bytes(4)
LENGTHS = {
    "names": struct.pack("<I", 2**31 - 1) + bytes(64),
    "names of no length": struct.pack("<I", 2**22) + bytes(2**20),
    "positions": struct.pack("<II", 0, 2**32 - 1) + bytes(64),
    "a long name": struct.pack("<II", 1, 2**32 - 5) + b"x" * 64,
    "a name of negative length": struct.pack("<Ii", 2**20, -4) + b"x" * 64,
}


@pytest.mark.parametrize("kind", LENGTHS)
def test_lengths_beyond_the_message_are_refused(tmp_path: Path, kind: str, capsys: Any) -> None:
    bag = write_raw(tmp_path / "bag", HEAD + LENGTHS[kind])
    with pytest.raises(BagError, match="cylinder_strokes at log time 1 ns"):
        list(read(scan(bag), {"cylinder_strokes": JOINT_STATE}))
    assert main(["info", str(bag)]) == 0
    capsys.readouterr()


def test_too_many_messages_out_of_order_are_not_held(bag: Path, monkeypatch: pytest.MonkeyPatch, rewritten: Any) -> None:
    file = rewritten(bag, backwards=True)
    monkeypatch.setattr(session_file, "MOST_TOGETHER", 3)
    with pytest.raises(BagError, match="3 messages are out of order"):
        list(read(scan(file), {"cylinder_strokes": JOINT_STATE}))


def test_a_truth_that_unpacks_without_end_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(truth, "LARGEST_TRUTH", 10_000)
    (tmp_path / truth.FILE_NAME).write_bytes(gzip.compress(b"t_s\n" + b"0\n" * 100_000))
    with pytest.raises(BagError, match="more than 10000 bytes unpacked"):
        truth.load_truth(tmp_path)


def test_words_of_a_stranger_are_quoted_in_new_metadata(tmp_path: Path) -> None:
    """A note that looks like YAML stays a text."""
    note = "x\n!!python/object/apply:os.system [id]\nrosbag2_bagfile_information: {version: 1}\n- &a *a"
    with MessageWriter(tmp_path / "bag", {"strokes": load_topics().inputs[Stream.STROKES]}, {"origin": note}) as bag:
        bag.write_encoded("strokes", 1, HEAD + bytes(16))
    assert scan(tmp_path / "bag").notes == {"origin": note}
    recover(tmp_path / "bag", tmp_path / "out")
    assert scan(tmp_path / "out").notes["origin"] == note


PACK = {
    "zstd": zstandard.ZstdCompressor().compress,
    "lz4": lambda content: lz4.frame.compress(content, block_size=lz4.frame.BLOCKSIZE_MAX4MB),
}


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


DEFINED = record(3, struct.pack("<H", 1) + text("std_msgs/msg/Empty") + text("ros2msg") + text(""))
DEFINED += record(4, struct.pack("<HH", 1, 1) + text("/empty") + text("cdr") + struct.pack("<I", 0))
MESSAGE = record(5, struct.pack("<HIQQ", 1, 0, 5, 5) + b"\0\1\0\0")


def chunk(content: bytes, compression: str, crc: int) -> bytes:
    packed = PACK[compression](content)
    head = struct.pack("<QQQI", 0, 5, len(content), crc) + text(compression) + struct.pack("<Q", len(packed))
    return record(6, head + packed)


def bomb(file: Path, content: bytes, compression: str, crc: int) -> Path:
    """Write a file of equal chunks; of 64 kB where one chunk is not larger."""
    one = chunk(content, compression, crc)
    begin = MCAP0_MAGIC + record(1, text("ros2") + text("test")) + DEFINED + one * max(1, 65536 // len(one))
    end = record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + MCAP0_MAGIC
    file.write_bytes(begin + end)
    return file


@pytest.mark.system
@pytest.mark.parametrize(("compression", "is_summed"), [("zstd", True), ("lz4", False)])
def test_recovery_of_a_bomb_takes_little_memory(tmp_path: Path, compression: str, is_summed: bool) -> None:
    zeros = bytes(LARGEST_SUMMARY)
    path = bomb(tmp_path / "bomb.mcap", zeros, compression, zlib.crc32(zeros) if is_summed else 0)
    words = refused_in_little_memory(tmp_path, "recover", path, "--out", tmp_path / "out")
    assert "has opcode 0" in words
    assert not (tmp_path / "out").exists()


def test_a_chunk_of_too_many_records_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_records, "MOST_TOGETHER", 1000)
    content = DEFINED + 1001 * MESSAGE
    with pytest.raises(BagError, match="more than 1000 records in a chunk"):
        scan(bomb(tmp_path / "bomb.mcap", content, "zstd", zlib.crc32(content)))


def test_empty_pictures_are_read(tmp_path: Path) -> None:
    """16 MiB of zeros in a few records, as a camera with its lid on gives them, pack by 30 000 and are no bomb."""
    content = DEFINED + b"".join(record(5, struct.pack("<HIQQ", 1, i, i, i) + bytes(2**20)) for i in range(16))
    head = MCAP0_MAGIC + record(1, text("ros2") + text("test"))
    (tmp_path / "dark.mcap").write_bytes(head + DEFINED + chunk(content, "zstd", zlib.crc32(content)))
    outcome = recover(tmp_path / "dark.mcap", tmp_path / "out")
    assert outcome.saved.total() == 16 and scan(tmp_path / "out").topics[0].count == 16
