"""Small files that unpack to much: they end soon, in little memory, with what is wrong with them."""

from __future__ import annotations

import struct
import subprocess
import sys
import zlib
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.writer import MCAP0_MAGIC

from boom_twin.bag import mcap_records
from boom_twin.bag.mcap_records import LARGEST
from boom_twin.bag.reader import scan
from boom_twin.bag.recovery.recover import recover
from boom_twin.errors import BagError

SIZE = 65536  # bytes of a file, at least
MEGABYTES = 400
PACK = {
    "zstd": zstandard.ZstdCompressor().compress,
    "lz4": lambda content: lz4.frame.compress(content, block_size=lz4.frame.BLOCKSIZE_MAX4MB),
}
MEASURED = """
import re, sys
from boom_twin.cli.main import main
code = main(sys.argv[1:])
print(int(re.search(r"VmHWM:\\s*(\\d+)", open("/proc/self/status").read())[1]) // 1024)
sys.exit(code)
"""


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
    begin = MCAP0_MAGIC + record(1, text("ros2") + text("test")) + DEFINED + one * max(1, SIZE // len(one))
    end = record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + MCAP0_MAGIC
    file.write_bytes(begin + end)
    return file


@pytest.mark.parametrize(("compression", "is_summed"), [("zstd", True), ("lz4", False)])
def test_recovery_of_a_bomb_takes_little_memory(tmp_path: Path, compression: str, is_summed: bool) -> None:
    zeros = bytes(LARGEST)
    path = bomb(tmp_path / "bomb.mcap", zeros, compression, zlib.crc32(zeros) if is_summed else 0)
    program = [sys.executable, "-c", MEASURED, "recover", path, "--out", tmp_path / "out", "--unverified"]
    done = subprocess.run(program, capture_output=True, text=True, timeout=200, check=False)
    assert done.returncode == 1 and "there is none" in done.stderr and "Traceback" not in done.stderr
    assert int(done.stdout.split()[-1]) < MEGABYTES
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
