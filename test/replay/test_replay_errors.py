"""Sessions that cannot be replayed give one clear error; sessions with holes are replayed and say so."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin import load_scene, replay
from boom_twin.errors import BagError
from boom_twin.io.session import write_session
from boom_twin.scene.kinematics import strokes_of_posture

START, STEP = 1_700_000_000_000_000_000, 5_000_000


def session(path, rows=200, hole=None, strokes=None, joints=True):
    """A boom at rest, recorded; `hole` leaves out rows."""
    scene = load_scene()
    keep = np.array([k for k in range(rows) if hole is None or not hole[0] <= k < hole[1]])
    still = np.tile(strokes_of_posture(scene, "arch") if strokes is None else strokes, (len(keep), 1))
    write_session(path, START + keep * STEP, still, np.zeros_like(still), None, {"origin": "synthetic, a test"})
    return path


def test_missing_folder(tmp_path):
    with pytest.raises(BagError, match="no such file or directory"):
        replay(tmp_path / "nothing", load_scene(), tmp_path / "out")


def test_strokes_that_are_not_the_scenes(tmp_path):
    with pytest.raises(BagError, match=r"no stroke sample could be used.*cylinder_1\.\.4"):
        replay(session(tmp_path / "bag", strokes=[5.0, 5.0, 5.0, 5.0]), load_scene(), tmp_path / "out")


def test_a_damaged_file_names_itself(tmp_path):
    bag = session(tmp_path / "bag")
    file = next(bag.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with pytest.raises(BagError, match=file.name):
        replay(bag, load_scene(), tmp_path / "out")


def test_an_output_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(BagError, match="file"):
        replay(session(tmp_path / "bag"), load_scene(), tmp_path / "file" / "out")


def test_a_gap_is_an_alarm_with_its_times(tmp_path):
    result = replay(session(tmp_path / "bag", hole=(60, 140)), load_scene(), tmp_path / "out")
    alarm = result.summary["alarms"][0]
    assert (alarm["channel"], alarm["kind"], alarm["cause"]) == ("cylinder_strokes", "gap", None)
    assert (alarm["from_s"], alarm["to_s"]) == (pytest.approx(0.295), pytest.approx(0.7))
    assert result.summary["samples"] == 120


def test_an_earlier_result_is_replaced_but_nothing_else(tmp_path):
    bag, out = session(tmp_path / "bag"), tmp_path / "out"
    replay(bag, load_scene(), out)
    (out / "notes.txt").write_text("keep me")
    replay(bag, load_scene(), out)
    assert (out / "notes.txt").read_text() == "keep me"
