"""Small files that unpack to much: they end soon, in little memory, with what is wrong with them."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.records import Chunk
from mcap.writer import MCAP0_MAGIC

from boom_twin.bag.mcap_records import LARGEST, UnpackBudget, UnpackError
from boom_twin.bag.reader import scan
from boom_twin.bag.recovery.recover import recover
from boom_twin.bag.recovery.scanner import DamagedBytes, scan_damaged

SIZE = 65536  # bytes of a file, at least
SECONDS, MEGABYTES = 1.0, 400
PACK = {
    "zstd": zstandard.ZstdCompressor().compress,
    "lz4": lambda content: lz4.frame.compress(content, block_size=lz4.frame.BLOCKSIZE_MAX4MB),
}
MEASURED = """
import sys
from boom_twin.cli.main import main
import resource, boom_twin.cli.%s
def used():
    each = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in each)
before = used()
try:
    code = main(sys.argv[1:])
finally:
    import json, re
    peak = int(re.search(r"VmHWM:\\s*(\\d+)", open("/proc/self/status").read())[1]) // 1024
    print(json.dumps({"code": code, "seconds": used() - before, "peak": peak}))
"""

IMPORTS = {
    "replay": "replay, boom_twin.offline.replay, boom_twin.twin.twin, boom_twin.plots",
    "monitor": "monitor, boom_twin.monitor.data.bag_feed, boom_twin.monitor.server, boom_twin.twin.twin",
}


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


DEFINED = record(3, struct.pack("<H", 1) + text("std_msgs/msg/Empty") + text("ros2msg") + text(""))
DEFINED += record(4, struct.pack("<HH", 1, 1) + text("/empty") + text("cdr") + struct.pack("<I", 0))
MESSAGE = record(5, struct.pack("<HIQQ", 1, 0, 5, 5) + b"\0\1\0\0")
CONTENTS = {"zeros": bytes(LARGEST), "messages": DEFINED + MESSAGE * ((LARGEST - len(DEFINED)) // len(MESSAGE))}
UNPACK = UnpackBudget.unpack
WORDS = {"zeros": "there is none", "messages": "the most that is read. Bombs pack like that"}
SUMS = {"wrong": lambda content: 1, "right": zlib.crc32, "none": lambda content: 0}


def chunk(content: bytes, compression: str, crc: int) -> bytes:
    packed = PACK[compression](content)
    head = struct.pack("<QQQI", 0, 5, len(content), crc) + text(compression) + struct.pack("<Q", len(packed))
    return record(6, head + packed)


@pytest.fixture(scope="module")
def bombs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a bomb for every compression, content and checksum; of 64 kB where one chunk is not larger."""
    folder = tmp_path_factory.mktemp("bombs")
    for compression in PACK:
        for name, content in CONTENTS.items():
            for crc, sum_of in SUMS.items():
                one = chunk(content, compression, sum_of(content))
                begin = MCAP0_MAGIC + record(1, text("ros2") + text("test")) + DEFINED + one * max(1, SIZE // len(one))
                end = record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + MCAP0_MAGIC
                (folder / f"{compression}_{name}_{crc}.mcap").write_bytes(begin + end)
                (folder / f"{compression}_{name}_{crc}_cut.mcap").write_bytes(begin[:-10])
    return folder


def measured(command: str, *arguments: object) -> tuple[dict[str, float], str]:
    """What a command used, its imports aside, and what it said."""
    program = [sys.executable, "-c", MEASURED % IMPORTS.get(command, command), command, *map(str, arguments)]
    done = subprocess.run(program, capture_output=True, text=True, timeout=200, check=False)
    assert "Traceback" not in done.stderr, done.stderr
    return json.loads(done.stdout.splitlines()[-1]), done.stderr


@pytest.mark.parametrize("cut", ["", "_cut"])
@pytest.mark.parametrize(
    ("compression", "content", "crc"), [("zstd", "messages", "wrong"), ("zstd", "zeros", "right"), ("lz4", "messages", "none")]
)
def test_recovery_of_a_bomb_ends_soon(bombs: Path, tmp_path: Path, compression: str, content: str, crc: str, cut: str) -> None:
    path = bombs / f"{compression}_{content}_{crc}{cut}.mcap"
    used, said = measured("recover", path, "--out", tmp_path / "out", "--unverified")
    assert used["seconds"] < SECONDS * max(1.0, path.stat().st_size / SIZE) and used["peak"] < MEGABYTES
    assert used["code"] == 1 and WORDS[content] in said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("cut", ["", "_cut"])
@pytest.mark.parametrize("name", ["lz4_zeros_wrong", "lz4_zeros_none", "zstd_messages_wrong"])
def test_a_chunk_that_is_not_sound_is_unpacked_once(bombs: Path, monkeypatch: pytest.MonkeyPatch, name: str, cut: str) -> None:
    path, unpacked = bombs / f"{name}{cut}.mcap", []
    monkeypatch.setattr(UnpackBudget, "unpack", lambda *of: unpacked.append(len(of[1].data)) or UNPACK(*of))
    faults = [each for each in scan_damaged(path, unverified=True) if isinstance(each, DamagedBytes)]
    assert faults and len(unpacked) == len([each for each in faults if "chunk" in each.reason])


READ = (("info", "zstd"), ("info", "lz4"), ("replay", "zstd"), ("monitor", "zstd"))


@pytest.mark.parametrize(("command", "compression"), READ)
def test_reading_a_bomb_ends_soon(bombs: Path, tmp_path: Path, command: str, compression: str) -> None:
    path = bombs / f"{compression}_messages_right.mcap"
    options = {"info": [path], "replay": [path, "--out", tmp_path / "out"], "monitor": ["--bag", path, "--port", "0"]}
    used, said = measured(command, *options[command])
    assert used["seconds"] < SECONDS * max(1.0, path.stat().st_size / SIZE) and used["peak"] < MEGABYTES
    assert used["code"] == 1 and "the most that is read" in said


def packed_chunk(content: bytes) -> Chunk:
    """A chunk of which only the packed content is looked at."""
    return Chunk("zstd", PACK["zstd"](content), 0, 0, 0, 0)


def test_a_bomb_takes_nothing_from_chunks_that_are_not() -> None:
    """The reserve is used up; a chunk that packs as recorded numbers do is read all the same."""
    budget = UnpackBudget()
    for _ in range(20):
        with pytest.raises(UnpackError, match="bytes unpack to more than"):
            budget.unpack(packed_chunk(CONTENTS["messages"]), LARGEST)
    assert budget.records == 0
    random = np.random.default_rng(1)
    messages = (struct.pack("<HIQQ", 1, i, i * 5_000_000, i * 5_000_000) + random.bytes(8) for i in range(20_000))
    content = b"".join(record(5, body) for body in messages)
    assert budget.unpack(packed_chunk(content), LARGEST) == content


def test_empty_pictures_are_read(tmp_path: Path) -> None:
    """16 MiB of zeros in a few records, as a camera with its lid on gives them, pack by 30 000 and are no bomb."""
    content = DEFINED + b"".join(record(5, struct.pack("<HIQQ", 1, i, i, i) + bytes(2**20)) for i in range(16))
    head = MCAP0_MAGIC + record(1, text("ros2") + text("test"))
    (tmp_path / "dark.mcap").write_bytes(head + DEFINED + chunk(content, "zstd", zlib.crc32(content)))
    outcome = recover(tmp_path / "dark.mcap", tmp_path / "out")
    assert outcome.saved.total() == 16 and scan(tmp_path / "out").topics[0].count == 16
