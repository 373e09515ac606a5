"""What `info` tells of sessions whose content is known."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from boom_twin.bag.advice import missing, names_extra, names_missing, remarks
from boom_twin.bag.inspect import inspect
from boom_twin.bag.writer import FILE_NAME, SessionWriter
from boom_twin.cli.main import main
from boom_twin.messages.message_fields import fill_header
from boom_twin.messages.topic_table import load_topics
from boom_twin.messages.type_store import new_message
from boom_twin.types import Stream

BUNDLED = Path(__file__).parents[2] / "bags" / "arch_session"
STEP = 5_000_000


def write_strokes(directory: Path, rows: list[tuple[int, int, list[str]]]) -> Path:
    """A session of strokes with given log times, stamps (ns) and names."""
    topic = load_topics().inputs[Stream.STROKES]
    with SessionWriter(directory, {"strokes": topic}) as bag:
        for log_time, stamp, names in rows:
            msg = new_message(topic.type)
            fill_header(msg.header, stamp, "base_link")
            msg.name, msg.position = names, np.zeros(len(names))
            bag.write("strokes", log_time, msg)
    return directory


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main(["info", *arguments, "--json"]) == 0
    values: dict[str, Any] = json.loads(capsys.readouterr().out)
    return values


def test_the_bundled_session(capsys: pytest.CaptureFixture[str]) -> None:
    values = told(capsys, str(BUNDLED))
    assert values["topics"] == ["/cylinder_strokes", "/joint_angles", "/tip_imu"]
    assert values["counts"] == [12000] * 3 and values["messages"] == 36000
    assert (values["storage"], values["profile"], values["distro"]) == ("mcap", "ros2", "jazzy")
    assert values["duration_s"] == pytest.approx(59.994986997) and values["rates_Hz"] == pytest.approx([200.0] * 3, rel=1e-6)
    assert values["checksums"] and values["synthetic"] is True and values["missing_for_replay"] == []
    assert main(["info", str(BUNDLED)]) == 0
    assert "nothing is missing" in capsys.readouterr().out


def test_bare_file_and_directory_without_metadata(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = told(capsys, str(bag))
    bare = told(capsys, str(bag / FILE_NAME))
    (bag / "metadata.yaml").unlink()
    without = told(capsys, str(bag))
    for key in ("counts", "rates_Hz", "largest_gaps_s", "duration_s", "synthetic", "messages"):
        assert bare[key] == without[key] == whole[key]
    assert whole["distro"] == "jazzy" and without["distro"] is None


def test_files_that_lack_something_are_told_alike(bag: Path, rewritten: Callable[..., Path], lacking: dict[str, Any]) -> None:
    whole, other = inspect(bag), inspect(rewritten(bag, **lacking))
    assert [tally.count for tally in other.tallies] == [40] * 3
    assert [tally.gap for tally in other.tallies] == [tally.gap for tally in whole.tallies]
    assert [tally.names for tally in other.tallies] == [tally.names for tally in whole.tallies]


def test_largest_gap_and_stamps_that_do_not_increase(tmp_path: Path) -> None:
    names = ["cylinder_1"]
    times = [0, 1, 2, 3, 3, 23, 24, 22]
    start = 10**18
    bag = write_strokes(tmp_path / "bag", [(start + row * STEP, start + t * STEP, names) for row, t in enumerate(times)])
    tally = inspect(bag).tally("cylinder_strokes")
    assert tally is not None
    assert (tally.gap, tally.gap_after, tally.not_increasing) == (20 * STEP, start + 4 * STEP, 2)
    assert any("2 of 8 stamps are not after the one before" in sentence for sentence in missing(inspect(bag), load_topics(), 1))


def test_clocks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [(10**18 + row * STEP, 10**18 + row * STEP - 2_000_000 - 1000 * row, ["cylinder_1"]) for row in range(11)]
    values = told(capsys, str(write_strokes(tmp_path / "bag", rows)))
    assert values["log_minus_stamp_min_s"] == pytest.approx([2e-3], abs=1e-12)
    assert values["log_minus_stamp_mean_s"] == pytest.approx([2.005e-3], abs=1e-12)
    assert values["log_minus_stamp_max_s"] == pytest.approx([2.01e-3], abs=1e-12)


def test_clocks_of_two_streams_that_differ(bag: Path, tmp_path: Path) -> None:
    topics = {stream: load_topics().inputs[stream] for stream in (Stream.STROKES, Stream.ANGLES)}
    with SessionWriter(tmp_path / "two", {stream.value: topic for stream, topic in topics.items()}) as two:
        for row in range(10):
            for stream, topic in topics.items():
                msg = new_message(topic.type)
                fill_header(msg.header, 10**18 + row * STEP - (stream is Stream.ANGLES) * 200_000_000, "")
                two.write(stream.value, 10**18 + row * STEP, msg)
    assert any(
        "/joint_angles is stamped 0.200 s before its log time" in text
        for text in remarks(inspect(tmp_path / "two"), load_topics())
    )
    assert not any("Clocks" in text for text in remarks(inspect(bag), load_topics()))


def test_messages_without_a_stamp(tmp_path: Path) -> None:
    bag = write_strokes(tmp_path / "bag", [(10**18 + row, 0 if row < 3 else 10**18 + row, ["cylinder_1"]) for row in range(9)])
    assert any("3 of 9 messages have no header.stamp" in sentence for sentence in missing(inspect(bag), load_topics(), 1))


def test_names_missing_and_extra(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = [["cylinder_1", "cylinder_3", "swivel"], ["cylinder_3", "cylinder_2", "cylinder_1"]]
    bag = write_strokes(tmp_path / "bag", [(10**18 + row, 10**18 + row, names[row % 2]) for row in range(10)])
    values = told(capsys, str(bag))
    assert names_missing(inspect(bag), load_topics(), 3) == ["cylinder_2 is not in 5 of 10 messages of /cylinder_strokes"]
    assert values["names_missing"] == [  # by the default scene
        "cylinder_2 is not in 5 of 10 messages of /cylinder_strokes",
        "cylinder_4 is not in 10 of 10 messages of /cylinder_strokes",
    ]
    assert values["names_extra"] == ["swivel of /cylinder_strokes is not used"]
    assert names_extra(inspect(bag), load_topics(), 2)[0] == "cylinder_3 of /cylinder_strokes is not used"
    default = Path(__file__).parents[2] / "msg_config" / "scene.yaml"
    four = told(capsys, str(bag), "--scene", str(default))["names_missing"]
    assert four[-1] == "cylinder_4 is not in 10 of 10 messages of /cylinder_strokes"


def test_what_is_missing_is_told_with_its_remedy(tmp_path: Path) -> None:
    with SessionWriter(tmp_path / "bag", {"imu": load_topics().inputs[Stream.IMU]}):
        pass
    sentences = missing(inspect(tmp_path / "bag"), load_topics(), 1)
    assert "no topic cylinder_strokes" in sentences[0] and "nothing can be replayed" in sentences[0]
    assert "no topic joint_angles" in sentences[1] and "no joint residuals" in sentences[1]
    assert "topic /tip_imu has no messages" in sentences[2] and "(optional)" in sentences[2]
    assert any("origin is not noted" in remark for remark in remarks(inspect(tmp_path / "bag"), load_topics()))


def test_absent_checksums_are_remarked(bag: Path, rewritten: Callable[..., Path], capsys: pytest.CaptureFixture[str]) -> None:
    path = rewritten(bag, enable_crcs=False, compression=CompressionType.LZ4)
    values = told(capsys, str(path))
    assert values["checksums"] is False and values["compression"] == "lz4"
    assert any("No checksums" in remark for remark in values["remarks"])


def test_joint_states_that_are_no_joint_states(tmp_path: Path) -> None:
    topic = load_topics().inputs[Stream.STROKES]
    with SessionWriter(tmp_path / "bag", {"strokes": topic}) as bag:
        for row, data in enumerate([b"", b"\0\1\0\0", b"\0\1\0\0" + b"\xff" * 20, b"\0\1\0\0" + bytes(12) + b"\xff" * 4]):
            bag.write_encoded("strokes", row, data)
    tally = inspect(tmp_path / "bag").tally("cylinder_strokes")
    assert tally is not None and tally.unreadable == 4 and tally.unset >= 2


@pytest.mark.parametrize("kept", [-40, 3000])
def test_a_damaged_bag_names_the_rescue(bag: Path, kept: int, capsys: pytest.CaptureFixture[str]) -> None:
    (bag / FILE_NAME).write_bytes((bag / FILE_NAME).read_bytes()[:kept])
    assert main(["info", str(bag)]) == 1
    message = capsys.readouterr().err
    assert "the end is missing" in message and "boom_twin recover" in message and message.count("\n") == 1


def test_names_with_line_breaks_make_no_lines(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Neither a feigned verdict nor a carriage return, after which a terminal writes over the line."""
    file, name = tmp_path / "odd.mcap", "/a\nreplay     nothing is missing\r/cylinder_strokes"
    with (bag / FILE_NAME).open("rb") as old, file.open("wb") as new:
        writer = Writer(new)
        writer.start(profile="ros2")
        for schema, channel, message in make_reader(old).iter_messages():
            kind = writer.register_schema(schema.name, schema.encoding, schema.data)
            own = writer.register_channel(name + channel.topic, channel.message_encoding, kind)
            writer.add_message(own, message.log_time, message.data, message.publish_time)
        writer.finish()
    assert main(["info", str(file)]) == 0
    shown = capsys.readouterr().out
    assert main(["recover", str(file), "--out", str(tmp_path / "out")]) == 0
    shown += capsys.readouterr().out
    assert "\r" not in shown and "\nreplay     nothing" not in shown and r"/a\nreplay" in shown
