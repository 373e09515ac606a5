"""Rescue of damaged sessions: what comes out went in, in order, and is counted truthfully."""

from __future__ import annotations

import hashlib
import json
import shutil
import struct
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import main
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer
from recordings import FILE_NAME, Recovery, recover, scan
from rosbags.highlevel import AnyReader

from boom_twin import BagError

BUNDLED = Path(__file__).parents[2] / "bags" / "arch_session"
Row = tuple[str, str, int, int, int, bytes]


def rows(path: Path) -> list[Row]:
    """All messages of one file by the mcap reader, in the order of the file."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        return [
            (channel.topic, schema.name, message.log_time, message.publish_time, message.sequence, message.data)
            for schema, channel, message in reader.iter_messages(log_time_order=False)
        ]


def is_part_of(some: list[Row], whole: list[Row]) -> bool:
    rest = iter(whole)
    return all(row in rest for row in some)


def check(outcome: Recovery, out: Path, whole: list[Row]) -> None:
    """Saved is what went in, as often as is said, for every reader."""
    found = [row for file in sorted(out.glob("*.mcap")) for row in rows(file)]
    assert is_part_of(found, whole)
    assert Counter(row[0] for row in found) == outcome.saved
    assert sum(topic.count for topic in scan(out).topics) == len(found)
    with AnyReader([out]) as reader:
        assert sum(1 for _ in reader.messages()) == len(found)
    if outcome.lost is not None:
        there = Counter(row[0] for row in whole)
        assert {topic: outcome.saved[topic] + lost for topic, lost in outcome.lost.items()} == dict(there)


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, list[Row]]:
    """The bundled session: its file, and its messages."""
    return (BUNDLED / FILE_NAME).read_bytes(), rows(BUNDLED / FILE_NAME)


def damaged(tmp_path: Path, data: bytes) -> Path:
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    return path


def rescue(tmp_path: Path, data: bytes, **options: Any) -> tuple[Recovery, Path]:
    """Rescue of a file with those bytes, which stays as it is."""
    path, out = damaged(tmp_path, data), tmp_path / "out"
    shutil.rmtree(out, ignore_errors=True)
    outcome = recover(path, out, **options)
    assert path.read_bytes() == data
    return outcome, out


def test_bytes_that_are_missing_near_the_start_cost_the_first_chunk(real: tuple[bytes, list[Row]], tmp_path: Path) -> None:
    """The only definitions left are in the summary, which is not where the footer says."""
    outcome, out = rescue(tmp_path, real[0][:200] + real[0][4000:])
    check(outcome, out, real[1])
    assert outcome.lost is not None and 0 < sum(outcome.lost.values()) < 0.02 * len(real[1])


def test_the_bundled_session_cut_and_with_flipped_bits(real: tuple[bytes, list[Row]], tmp_path: Path) -> None:
    random, data = np.random.default_rng(2), bytearray(real[0])
    for place in random.integers(0, len(data), 6):
        data[place] ^= 1 << int(random.integers(8))
    kept = int(random.integers(200_000, len(data)))
    outcome, out = rescue(tmp_path, bytes(data[:kept]))
    check(outcome, out, real[1])
    assert outcome.saved.total() > len(real[1]) * (kept / len(data) - 7 / 60)


CHUNKED = {
    "zstd": {"compression": CompressionType.ZSTD},
    "lz4": {"compression": CompressionType.LZ4},
    "none": {"compression": CompressionType.NONE},
    "unindexed": {"index_types": IndexType.NONE, "repeat_channels": False, "use_statistics": False},
}


@pytest.mark.parametrize("options", CHUNKED.values(), ids=CHUNKED)
def test_a_flipped_bit_anywhere_costs_at_most_its_chunk(
    bag: Path, rewritten: Callable[..., Path], tmp_path: Path, options: dict[str, Any]
) -> None:
    path = rewritten(bag, **options)
    data, whole = path.read_bytes(), rows(path)
    random = np.random.default_rng(5)
    for place, bit in zip(random.integers(0, len(data), 10), random.integers(0, 8, 10), strict=True):
        flipped = bytearray(data)
        flipped[place] ^= 1 << int(bit)
        try:
            outcome, out = rescue(tmp_path, bytes(flipped))
        except BagError as error:  # the chunk that defines the topics, with no summary to repeat them
            assert "unindexed" not in str(error) and options.get("repeat_channels") is False
            continue
        check(outcome, out, whole)
        if "repeat_channels" not in options:
            assert outcome.saved.total() >= len(whole) - 12, f"bit {bit} of byte {place}"


def test_cut_off_at_every_kind_of_place(bag: Path, tmp_path: Path, rewritten: Callable[..., Path]) -> None:
    path = rewritten(bag)
    data, whole = path.read_bytes(), rows(path)
    best = 0
    for kept in range(0, len(data), 2003):
        try:
            outcome, out = rescue(tmp_path, data[:kept])
        except BagError as error:
            assert "nothing can be saved" in str(error) and not (tmp_path / "out").exists() and best == 0
            continue
        check(outcome, out, whole)
        assert (outcome.saved.total() >= best and outcome.lost is None) or kept > len(data) - 2003
        best = outcome.saved.total()
    assert best == len(whole)


def test_a_file_without_chunks_is_saved_up_to_its_end_and_behind_damage(
    bag: Path, tmp_path: Path, rewritten: Callable[..., Path]
) -> None:
    """Nothing vouches for its messages, unless a checksum over all of them fits."""
    path = rewritten(bag, use_chunking=False)
    data, whole = path.read_bytes(), rows(path)
    for cut in (1.0, 0.6):
        outcome, out = rescue(tmp_path, data[: int(cut * len(data))])
        check(outcome, out, whole)
        assert outcome.unvouched == outcome.saved and outcome.saved.total() >= int(cut * len(whole)) - 6
    middle = len(data) // 2
    outcome, out = rescue(tmp_path, data[:middle] + bytes(40) + data[middle + 40 :])
    assert len(whole) - 4 <= outcome.saved.total() <= len(whole) and outcome.lost is not None
    assert len(set(rows(out / FILE_NAME)) - set(whole)) <= 1  # the bytes that were hit
    outcome, _ = rescue(tmp_path, rewritten(bag, use_chunking=False, enable_data_crcs=True).read_bytes())
    assert outcome.unvouched.total() == 0 and outcome.saved.total() == 120


def test_the_start_of_a_cut_chunk_is_saved_without_vouching_for_it(
    bag: Path, tmp_path: Path, rewritten: Callable[..., Path]
) -> None:
    path = rewritten(bag, chunk_size=1 << 20)
    data, whole = path.read_bytes(), rows(path)
    outcome, out = rescue(tmp_path, data[:9000])
    check(outcome, out, whole)
    assert outcome.unvouched == outcome.saved and outcome.saved.total() > 20


def test_a_directory_with_a_bad_chunk_knows_what_is_lost(bag: Path, tmp_path: Path) -> None:
    shutil.copytree(BUNDLED, tmp_path / "copy")
    file = tmp_path / "copy" / FILE_NAME
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 4
    file.write_bytes(data)
    outcome = recover(tmp_path / "copy", tmp_path / "out")
    check(outcome, tmp_path / "out", rows(BUNDLED / FILE_NAME))
    assert outcome.lost is not None and 0 < sum(outcome.lost.values()) < 700 and outcome.fault_count == 1
    notes = scan(tmp_path / "out").notes
    assert notes["recovered from"] == "copy" and "synthetic" in notes["origin"]


def test_metadata_that_is_garbage_and_files_that_it_does_not_name(bag: Path, tmp_path: Path) -> None:
    shutil.copy(bag / FILE_NAME, bag / "session_10.mcap")
    shutil.copy(bag / FILE_NAME, bag / "session_9.mcap")
    (bag / "metadata.yaml").write_text("{")
    outcome = recover(bag, tmp_path / "out")
    assert outcome.saved.total() == 3 * len(rows(bag / FILE_NAME))
    assert [file.name for file in (tmp_path / "out").glob("*.mcap")] == [FILE_NAME]


def test_the_source_and_what_is_there_are_not_touched(bag: Path, tmp_path: Path) -> None:
    def sums() -> dict[Path, str]:
        return {file: hashlib.sha256(file.read_bytes()).hexdigest() for file in bag.iterdir()}

    before = sums()
    for out in (bag, bag / "inside"):
        with pytest.raises(BagError, match="lies in the source"):
            recover(bag, out)
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "a").touch()
    with pytest.raises(BagError, match="holds a already"):
        recover(bag, tmp_path / "taken")
    recover(bag, tmp_path / "out")
    assert sums() == before


def test_the_command_tells_the_count(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = damaged(tmp_path, (bag / FILE_NAME).read_bytes()[:-30])
    assert main(["recover", str(path), "--out", str(tmp_path / "out"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["saved"] == [40, 40, 40] and told["messages"] == 120 and told["lost"] == [None] * 3
    assert main(["recover", str(path), "--out", str(tmp_path / "other")]) == 0
    assert "unknown" in capsys.readouterr().out
    assert main(["recover", str(tmp_path / "none"), "--out", str(tmp_path / "third")]) == 1
    assert "no such file" in capsys.readouterr().err


@pytest.mark.parametrize(
    "data",
    [b"", b"x", bytes(100_000), b"\x06" * 100_000, struct.pack("<BQ", 6, 2**62) * 3000, b"\x05" + bytes(8) + b"\xff" * 9000],
)
def test_bytes_that_are_no_bag(tmp_path: Path, data: bytes) -> None:
    with pytest.raises(BagError, match="nothing can be saved"):
        rescue(tmp_path, data)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("start", [2**64 - 1, 2**63, 10**6, 10**4 + 1])
def test_a_summary_that_is_said_to_be_elsewhere_costs_nothing(bag: Path, tmp_path: Path, start: int) -> None:
    """The footer of a file that is whole otherwise names a byte that is not that of the summary."""
    file = bag / FILE_NAME
    whole, data = rows(file), bytearray(file.read_bytes())
    struct.pack_into("<Q", data, len(data) - 28, start)
    file.write_bytes(data)
    with pytest.raises(BagError, match="boom_twin recover BAG"):
        scan(bag)
    outcome = recover(bag, tmp_path / "out")
    assert outcome.saved.total() == len(whole)


@pytest.mark.parametrize("size", [300, 100_000])
def test_equal_messages_that_were_recorded_are_all_saved(tmp_path: Path, size: int) -> None:
    """In one chunk and in equal chunks: a clock that stands still gives such ones."""
    path = tmp_path / "equal.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=size, compression=CompressionType.NONE)
        writer.start(profile="ros2", library="test")
        channel = writer.register_channel("/p", "cdr", writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data"))
        for _ in range(40):
            writer.add_message(channel, 7, b"\0\1\0\0" + bytes(60), 7)
        writer.finish()
    outcome, _ = rescue(tmp_path, path.read_bytes())
    assert (outcome.saved.total(), outcome.lost) == (40, {"/p": 0})
