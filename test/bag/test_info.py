"""What `info` tells of sessions whose content is known."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import main
from recordings import FILE_NAME, MessageWriter
from ros_messages import joint_state, load_topics

from boom_twin import Stream

ROOT = Path(__file__).parents[2]
START, STEP = 10**18, 5_000_000


def told(capsys: pytest.CaptureFixture[str], path: Path, *arguments: str) -> dict[str, Any]:
    assert main(["info", str(path), *arguments, "--json"]) == 0
    values: dict[str, Any] = json.loads(capsys.readouterr().out)
    return values


def test_the_bundled_session(capsys: pytest.CaptureFixture[str]) -> None:
    bundled = ROOT / "bags" / "arch_session"
    values, bare = told(capsys, bundled), told(capsys, bundled / FILE_NAME)
    assert values["topics"] == ["/cylinder_strokes", "/joint_angles", "/tip_imu"]
    assert values["counts"] == [12000] * 3 and values["messages"] == 36000
    assert (values["storage"], values["profile"], values["distro"], bare["distro"]) == ("mcap", "ros2", "jazzy", None)
    assert values["duration_s"] == pytest.approx(59.994986997) and values["rates_Hz"] == pytest.approx([200.0] * 3, rel=1e-6)
    assert values["checksums"] and values["synthetic"] is True and values["missing_for_replay"] == []
    assert all(bare[key] == values[key] for key in ("counts", "rates_Hz", "largest_gaps_s", "duration_s", "synthetic"))
    assert main(["info", str(bundled)]) == 0
    assert "nothing is missing" in capsys.readouterr().out
    assert main(["info", str(bundled), "--start", "100"]) == 1
    assert "no message from 100 s on; the session lasts 60.0 s" in capsys.readouterr().err


Row = tuple[Stream, int, int, list[str]]
"""Stream, log time and stamp (ns), names."""


def write(directory: Path, rows: list[Row]) -> Path:
    topics = {stream: load_topics().inputs[stream] for stream in dict.fromkeys(stream for stream, *_ in rows)}
    with MessageWriter(directory, {stream.value: topic for stream, topic in topics.items()}) as bag:
        for stream, log_time, stamp, names in rows:
            bag.write(stream.value, log_time, joint_state(names, np.zeros(len(names)), stamp))
    return directory


def test_two_recordings_in_one_folder_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Files of one recorder follow each other, whatever their names are."""
    (tmp_path / "both").mkdir()
    for name, first in (("a", 0), ("b", 3), ("c", 6)):
        rows: list[Row] = [(Stream.STROKES, START + t, START + t, ["cylinder_1"]) for t in (first * 10**9, (first + 3) * 10**9)]
        (write(tmp_path / name, rows) / FILE_NAME).rename(tmp_path / "both" / f"{name}.mcap")
    assert told(capsys, tmp_path / "both")["incomplete"] is None
    (tmp_path / "both" / "b.mcap").rename(tmp_path / "both" / "a2.mcap")
    (tmp_path / "both" / "c.mcap").write_bytes((tmp_path / "both" / "a2.mcap").read_bytes())
    assert told(capsys, tmp_path / "both")["incomplete"].startswith(
        "a2.mcap and c.mcap overlap by 3.0 s. If they are two recordings"
    )


def test_gaps_clocks_and_stamps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    steps = [0, 1, 2, 3, 3, 23, 24, 22]
    rows: list[Row] = [(Stream.STROKES, START + k * STEP, START + t * STEP, ["cylinder_1"]) for k, t in enumerate(steps)]
    values = told(capsys, write(tmp_path / "gap", rows))
    assert values["largest_gaps_s"] + values["largest_gaps_at_s"] == pytest.approx([0.1, 0.02])
    assert values["stamps_not_increasing"] == [2]
    for sentence in ("stamps step back once, first from 0.120 to 0.110 s", "stamps equal the one before"):
        assert any(sentence in told_missing for told_missing in values["missing_for_replay"])
    slow: list[Row] = [(Stream.STROKES, START + k * 40 * STEP, START + k * 40 * STEP, ["cylinder_1"]) for k in range(9)]
    sentences = told(capsys, write(tmp_path / "slow", slow))["missing_for_replay"]
    assert any("stamps are 0.2 s apart. The setting gap, 0.1 s" in sentence for sentence in sentences)
    rows = [(Stream.STROKES, START + k * STEP, START + k * STEP - 2_000_000 - 1000 * k, ["cylinder_1"]) for k in range(11)]
    rows += [(Stream.STROKES, START + k * STEP, 0, ["cylinder_1"]) for k in range(11, 14)]
    rows += [(Stream.ANGLES, START + k * STEP, START + k * STEP - 200_000_000, ["joint_1"]) for k in range(11)]
    values = told(capsys, write(tmp_path / "clocks", rows))
    for name, strokes in (("min", 2e-3), ("mean", 2.005e-3), ("max", 2.01e-3)):
        assert values[f"log_minus_stamp_{name}_s"] == pytest.approx([strokes, 0.2], abs=1e-12)
    assert values["stamps_unset"] == [3, 0]
    assert any("/joint_angles is stamped 0.198 s before its log time" in remark for remark in values["remarks"])


def test_bursts_are_told_and_messages_of_single_sensors_are_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bursts = [START + k // 5 * 10 * STEP + k % 5 * 100_000 for k in range(200)]
    rows: list[Row] = [(Stream.STROKES, START + k * STEP, stamp, ["cylinder_1"]) for k, stamp in enumerate(bursts)]
    (sentence, *_) = told(capsys, write(tmp_path / "bursts", rows))["missing_for_replay"][1:]
    assert "/cylinder_strokes: readings come in bursts of 5, 0.05 s apart" in sentence
    rows = [(*row[:3], [f"cylinder_{k % 5 + 1}"]) for k, row in enumerate(rows)]  # each of a bus in messages of its own
    assert "come in bursts" not in str(told(capsys, write(tmp_path / "bus", rows)))


def test_a_driving_sensor_that_is_never_named_is_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ["cylinder_1", "cylinder_2", "cylinder_3", "swivel"]
    bag = write(tmp_path / "bag", [(Stream.STROKES, START + row, START + row, names) for row in range(10)])
    told_missing = told(capsys, bag)["missing_for_replay"]
    assert any("/cylinder_strokes never names cylinder_4, but cylinder_1" in sentence for sentence in told_missing)


def test_what_is_missing_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with MessageWriter(tmp_path / "bag", {"imu": load_topics().inputs[Stream.IMU]}):
        pass
    values = told(capsys, tmp_path / "bag")
    places = ("no topic cylinder_strokes", "no topic joint_angles", "topic /tip_imu has no messages")
    assert [place in told for place, told in zip(places, values["missing_for_replay"], strict=True)] == [True] * 3
    assert values["synthetic"] is None and any("origin" in remark for remark in values["remarks"])


def test_names_with_line_breaks_make_no_lines(
    bag: Path, tmp_path: Path, rewritten: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither a feigned verdict nor a carriage return, after which a terminal writes over the line."""
    file = rewritten(bag, rename=lambda name: f"/a\nreplay     nothing is missing\r/cylinder_strokes{name}")
    assert main(["info", str(file)]) == main(["recover", str(file), "--out", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out
    assert "\r" not in shown and "\nreplay     nothing" not in shown and r"/a\nreplay" in shown
