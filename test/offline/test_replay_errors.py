"""Sessions that cannot be replayed give one clear error; sessions with holes are replayed and say so."""

from __future__ import annotations

import numpy as np
import pytest
from command import main
from default_boom import strokes_of_posture
from recordings import MessageWriter, write_session
from ros_messages import fill_header, load_topics, new_message

from boom_twin import BagError, Stream, load_scene, replay
from boom_twin.cli.replay import as_text

START, STEP = 1_700_000_000_000_000_000, 5_000_000


def session(path, rows=200, hole=None, strokes=None, joints=True):
    """A boom at rest, recorded; `hole` leaves out rows."""
    scene = load_scene()
    keep = np.array([k for k in range(rows) if hole is None or not hole[0] <= k < hole[1]])
    still = np.tile(strokes_of_posture(scene, "arch") if strokes is None else strokes, (len(keep), 1))
    write_session(path, START + keep * STEP, still, np.zeros_like(still), None, {"origin": "synthetic, a test"})
    return path


def test_a_missing_folder_is_told_before_the_model_is_compiled(tmp_path, capsys):
    assert main(["replay", str(tmp_path / "nothing"), "--out", str(tmp_path / "out")]) == 1
    (told,) = capsys.readouterr().err.splitlines()
    assert told.startswith(f"boom_twin replay: {tmp_path / 'nothing'}: there is no such file or directory. Give")


def test_strokes_that_are_not_the_scenes(tmp_path):
    with pytest.raises(BagError, match=r"no stroke sample could be used.*cylinder_1\.\.4"):
        replay(session(tmp_path / "bag", strokes=[5.0, 5.0, 5.0, 5.0]), load_scene(), tmp_path / "out")


def test_a_cylinder_without_a_single_value_is_named(tmp_path):
    strokes = strokes_of_posture(load_scene(), "arch")
    strokes[1] = np.nan
    with pytest.raises(BagError, match=r"no stroke sample could be used.*cylinder_2 never had a value"):
        replay(session(tmp_path / "bag", strokes=strokes), load_scene(), tmp_path / "out")


def test_strokes_that_come_too_rarely_are_not_told_by_the_residuals_that_lack(tmp_path):
    strokes = strokes_of_posture(load_scene(), "arch")
    stamps, still = START + np.arange(400) * STEP, np.tile(strokes, (400, 1))
    still[np.arange(400) % 40 > 0] = np.nan  # angles 40 times as often
    write_session(tmp_path / "bag", stamps, still, np.zeros_like(still), None, {"origin": "synthetic, a test"})
    with pytest.raises(BagError, match=r"Most often leap: .* within `gap` \(raise it for rates below 10 Hz\)"):
        replay(tmp_path / "bag", load_scene(), tmp_path / "out")


def test_a_constant_residual_is_not_said_to_be_as_expected(tmp_path):
    result = replay(session(tmp_path / "bag"), load_scene(), tmp_path / "out")  # all angles recorded are 0: none is right
    mean = np.abs(result.summary["joint_residual_normalised_mean"])
    told = [line for line in as_text(result.summary) if line.endswith("times the expected noise")]
    ratios = [float(line.split("rms, ")[1].split()[0]) for line in told]
    assert len(ratios) == 4 and (mean > 100).any()
    np.testing.assert_array_less(mean, np.array(ratios) + 0.06)  # told to a decimal


def test_a_gap_is_an_alarm_with_its_times(tmp_path):
    result = replay(session(tmp_path / "bag", hole=(60, 140)), load_scene(), tmp_path / "out", health=False)
    alarm = result.summary["alarms"][0]
    assert (alarm["channel"], alarm["kind"], alarm["cause"]) == ("cylinder_strokes", "gap", None)
    assert (alarm["from_s"], alarm["to_s"]) == (pytest.approx(0.295), pytest.approx(0.705))
    assert (result.summary["samples"], result.summary["dropped"]) == (119, 1)  # the first after it is confirmed by the next


def test_stray_stamps_are_dropped_and_told(tmp_path):
    """Of the far future, of 1970 and unset; the samples after them are used at once."""
    scene = load_scene()
    still = strokes_of_posture(scene, "arch")
    topic = load_topics().inputs[Stream.STROKES]
    stray = {50: (2**31 - 1) * 10**9, 70: 10**9, 90: 0}
    with MessageWriter(tmp_path / "bag", {"strokes": topic}) as bag:
        for row in range(200):
            msg = new_message(topic.type)
            fill_header(msg.header, stray.get(row, START + row * STEP))
            msg.name, msg.position = [f"cylinder_{i}" for i in range(1, 5)], np.array(still)
            bag.write("strokes", START + row * STEP, msg)
    result = replay(tmp_path / "bag", scene, tmp_path / "out")
    assert (result.summary["samples"], result.summary["dropped"]) == (197, 3)
    assert result.summary["events"] == {"leap": 2, "no stamp": 1} and result.summary["alarms"] == []
    stamps = result.recording.whole.predictions.stamps.tolist()
    assert stamps == [START + row * STEP for row in range(200) if row not in stray]


def content_of(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_replay_that_fails_leaves_nothing_that_is_believed(tmp_path):
    """An earlier result stays as it was; without one, nothing is there."""
    good, bad, out = session(tmp_path / "good"), session(tmp_path / "bad", strokes=[5.0, 5.0, 5.0, 5.0]), tmp_path / "out"
    with pytest.raises(BagError):
        replay(bad, load_scene(), out)
    assert not out.exists()
    replay(good, load_scene(), out)
    before = content_of(out)
    with pytest.raises(BagError):
        replay(bad, load_scene(), out)
    assert content_of(out) == before and {entry.name for entry in tmp_path.iterdir()} == {"good", "bad", "out"}
