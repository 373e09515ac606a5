"""Bags from strangers: nothing runs, nothing grows without bound, nothing is written or read outside the folder."""

from __future__ import annotations

import gzip
import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from boom_twin.bag import mcap_file
from boom_twin.bag.metadata import FILE_NAME as METADATA
from boom_twin.bag.reader import read, scan
from boom_twin.bag.recovery.recover import recover
from boom_twin.bag.session_sheet import FILE_NAME as SHEET
from boom_twin.bag.writer import SessionWriter
from boom_twin.cli.main import main
from boom_twin.config.yaml_text import MOST_VALUES, plain
from boom_twin.errors import BagError, SceneError
from boom_twin.messages.topic_table import load_topics
from boom_twin.offline import ground_truth as truth
from boom_twin.scene import load_scene
from boom_twin.types import Stream

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


@pytest.mark.parametrize("name", [name for name in BOMBS if name != "large"])
def test_yaml_that_would_grow_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=r"more than|nested|limit|tag|kind of key|this is no whole number"):
        plain(BOMBS[name])


def test_yaml_gives_plain_values_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=r"the tag tag:yaml.*is not allowed"):
        plain(BOMBS["tag"])
    assert not (tmp_path / "trap").exists()
    assert plain("a: 1\nb: [x, .5, 2001-01-01, null, yes, true]") == {"a": 1, "b": ["x", 0.5, "2001-01-01", None, "yes", True]}
    assert plain("") is None and plain("&a x") == "x" and plain("[&a [1], *a]") == [[1], [1]]
    assert len(plain("[" + "1," * (MOST_VALUES - 2) + "]")) == MOST_VALUES - 2


@pytest.mark.parametrize("file", [METADATA, SHEET])
@pytest.mark.parametrize("bomb", BOMBS)
@pytest.mark.system
def test_a_command_survives_bombs_beside_a_bag(bag: Path, bomb: str, file: str, tmp_path: Path) -> None:
    (bag / file).write_text(BOMBS[bomb])
    code = (  # the peak of this process: ru_maxrss would take over that of the one that started it
        "import re, sys; from boom_twin.cli.main import main; code = main(['info', sys.argv[1]]); "
        "print(int(re.search(r'VmHWM:\\s*(\\d+)', open('/proc/self/status').read())[1]) // 1024); sys.exit(code)"
    )
    options: Any = {"capture_output": True, "text": True, "timeout": 100, "cwd": tmp_path}
    done = subprocess.run([sys.executable, "-c", code, bag], env={**os.environ, "PYTHONPATH": str(ROOT)}, **options)
    assert int(done.stdout.split()[-1]) < MEGABYTES
    assert not (tmp_path / "trap").exists()
    assert done.returncode == 1 and file in done.stderr and "Traceback" not in done.stderr


def test_a_scene_with_a_million_values_is_refused(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(BOMBS["list"])
    with pytest.raises(SceneError, match="more than"):
        load_scene(tmp_path / "scene.yaml")


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
    (bag / SHEET).write_text("mapping: ''\n")
    before = set(tmp_path.rglob("*"))
    recover(bag, tmp_path / "out")
    made = {path.relative_to(tmp_path).as_posix() for path in set(tmp_path.rglob("*")) - before}
    assert made == {"out", "out/session_0.mcap", f"out/{METADATA}", f"out/{SHEET}"}
    assert (tmp_path / "out" / SHEET).read_text() == "mapping: ''\n"


def write_raw(directory: Path, *bodies: bytes) -> Path:
    """A session of strokes from encoded messages."""
    with SessionWriter(directory, {"strokes": load_topics().inputs[Stream.STROKES]}) as bag:
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
    monkeypatch.setattr(mcap_file, "MOST_TOGETHER", 3)
    with pytest.raises(BagError, match="3 messages are out of order"):
        list(read(scan(file), {"cylinder_strokes": JOINT_STATE}))


def test_a_truth_that_unpacks_without_end_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(truth, "LARGEST", 10_000)
    (tmp_path / truth.FILE_NAME).write_bytes(gzip.compress(b"t_s\n" + b"0\n" * 100_000))
    with pytest.raises(BagError, match="more than 10000 bytes unpacked"):
        truth.load_truth(tmp_path)


def test_words_of_a_stranger_are_quoted_in_new_metadata(tmp_path: Path) -> None:
    """A note that looks like YAML stays a text."""
    note = "x\n!!python/object/apply:os.system [id]\nrosbag2_bagfile_information: {version: 1}\n- &a *a"
    with SessionWriter(tmp_path / "bag", {"strokes": load_topics().inputs[Stream.STROKES]}, {"origin": note}) as bag:
        bag.write_encoded("strokes", 1, HEAD + bytes(16))
    assert scan(tmp_path / "bag").notes == {"origin": note}
    recover(tmp_path / "bag", tmp_path / "out")
    assert scan(tmp_path / "out").notes["origin"] == note
