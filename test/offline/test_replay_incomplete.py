"""Replays that are killed, and what is made of sessions and results that are not whole."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import strokes_of_posture
from recordings import scan, write_session

from boom_twin import BagError, Settings, load_scene, replay
from boom_twin.bag.session_file import WHOLE
from boom_twin.monitor.data.bag_feed import bag_feed
from boom_twin.offline.commissioning import wiring_of
from boom_twin.offline.inputs import ReplayOptions
from boom_twin.offline.replay import replay_into
from boom_twin.system.result_folder import REPLAY, result_folder

START, STEP = 1_700_000_000_000_000_000, 5_000_000


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """15 s of a boom at rest: long enough to be killed in the midst of them."""
    still = np.tile(strokes_of_posture(load_scene(), "arch"), (3000, 1))
    folder = tmp_path_factory.mktemp("session") / "bag"
    write_session(folder, START + STEP * np.arange(3000), still, np.zeros_like(still), None, {"origin": "synthetic, a test"})
    return folder


@pytest.fixture(scope="module")
def killed(session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder beside its result that a replay leaves when it is killed while it writes."""
    out = tmp_path_factory.mktemp("killed") / "out"
    command = [sys.executable, "-m", "boom_twin.cli.main", "replay", str(session), "--out", str(out)]
    with (out.parent / "log").open("w") as log:
        child = subprocess.Popen(command, stdout=log, stderr=log)
    file, end = out.with_name("out.unfinished") / "bag" / "session_0.mcap", time.monotonic() + 240.0
    while not file.exists() or file.stat().st_size < 200_000:
        assert child.poll() is None and time.monotonic() < end, (out.parent / "log").read_text()
        time.sleep(0.01)
    child.kill()
    child.wait()
    assert not out.exists()
    return file.parents[1]


@pytest.mark.parametrize(("value", "span"), [(np.nan, 1.0), (-9.999, 0.2)])
def test_a_transducer_is_used_again_as_soon_as_its_readings_are_back(tmp_path: Path, value: float, span: float) -> None:
    """It was left out for seconds more, while the boom moved on."""
    times, found = 0.01 * np.arange(1000), []
    strokes = np.tile(strokes_of_posture(load_scene(), "arch"), (1000, 1)) + np.random.default_rng(0).normal(
        0.0, 2e-5, (1000, 4)
    )
    strokes[:, 0] -= 0.05 * (1.0 - np.cos(0.4 * np.pi * times))
    is_lost = (times >= 5.0) & (times < 5.0 + span)
    for name, readings in (("sound", strokes), ("lost", np.where(is_lost[:, None] & (np.arange(4) == 0), value, strokes))):
        write_session(
            tmp_path / name, START + 2 * STEP * np.arange(1000), readings, None, None, {"origin": "synthetic, a test"}
        )
        found.append(replay(tmp_path / name, None, tmp_path / f"{name}_out", with_bag=False).columns())
    one, other = (columns["tip_y_m"][(times > 5.2 + span) & (times < 9.9)] for columns in found)
    np.testing.assert_allclose(other, one, atol=0.01)
    told = "100 readings missing, 0 beyond" if np.isnan(value) else "0 readings missing, 20 beyond"
    assert wiring_of(tmp_path / "lost", None, None, WHOLE).startswith(f"cylinder_1: {told} the travel; else strokes are within")
    assert "missing" not in wiring_of(tmp_path / "sound", None, None, WHOLE)


@pytest.mark.system
def test_a_killed_replay_says_so(killed: Path, session: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert not (killed / "bag" / "metadata.yaml").exists() and not (killed / "summary.json").exists()
    with pytest.raises(BagError, match=r"incomplete: the end is missing.*incomplete: .*unfinished\.json"):
        scan(killed / "bag")
    for command in (["info", killed / "bag"], ["compare", killed, session], ["monitor", "--bag", killed / "bag"]):
        assert main([str(part) for part in command]) == 1
        assert "incomplete" in capsys.readouterr().err


def test_a_bag_that_is_whole_in_a_result_that_is_not_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As when the kill comes between the bag and the figures; figures alone are not believed either."""
    unfinished = tmp_path / "out.unfinished"
    write_session(unfinished / "bag", START + STEP * np.arange(9), np.zeros((9, 1)), np.zeros((9, 1)), None, {})
    assert main(["info", str(unfinished / "bag")]) == 0
    assert "incomplete" not in capsys.readouterr().out
    (unfinished / "unfinished.json").write_text('{"command": "replay"}')
    assert main(["info", str(unfinished / "bag")]) == 0
    assert "state      incomplete: " in capsys.readouterr().out
    assert main(["info", "--json", str(unfinished / "bag" / "session_0.mcap")]) == 0
    assert json.loads(capsys.readouterr().out)["incomplete"].startswith("incomplete: ")
    for name, text in (("summary.json", '{"alarms": [], "output_sha256": ""}'), ("quantities.json", "{}")):
        (unfinished / name).write_text(text)
    assert main(["compare", str(unfinished), str(unfinished / "bag")]) == 1
    assert "incomplete" in capsys.readouterr().err


def unended(bag: Path) -> Path:
    """The session as a recorder leaves it that was killed after its last file was complete."""
    (bag / "session.yaml").write_text("boom_twin: 0.1.0\nstarted: 2026-01-02T03:04:05+00:00\nnote: |\n  ended: no\n")
    return bag


def test_a_recording_that_tells_no_end_is_incomplete_wherever_it_is_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    still = np.tile(strokes_of_posture(load_scene(), "arch"), (200, 1))
    stamps = START + STEP * np.arange(200)
    write_session(tmp_path / "bag", stamps, still, np.zeros_like(still), None, {"origin": "a test"})
    bag = unended(tmp_path / "bag")
    assert main(["info", str(bag)]) == 0
    assert "state      incomplete: the recorder was ended by force" in capsys.readouterr().out
    assert main(["replay", str(bag), "--out", str(tmp_path / "out"), "--no-pictures", "--no-health"]) == 0
    assert "warning: " in (words := capsys.readouterr().err) and "incomplete: the recorder was ended by force" in words
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["session_incomplete"].startswith("incomplete: ")
    assert "INCOMPLETE" in bag_feed(bag, load_scene(), Settings()).title
    assert main(["recover", str(bag), "--out", str(tmp_path / "saved")]) == 0
    assert scan(tmp_path / "saved").incomplete == ""
    with (bag / "session.yaml").open("a") as sheet:
        sheet.write("ended: 2026-01-02T03:05:05+00:00\n")
    assert scan(bag).incomplete == ""


@pytest.mark.system
def test_a_full_disk_leaves_one_line_and_an_earlier_result(session: Path, tmp_path: Path) -> None:
    """The limit on the size of a file stands for the disk's."""
    out = tmp_path / "out"
    with result_folder(out, REPLAY, [session]) as building:
        replay_into(building, session, load_scene(), options=ReplayOptions(health=False))
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    command = [sys.executable, "-m", "boom_twin.cli.main", "replay", str(session), "--out", str(out), "--no-health"]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=300, check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000)),
    )  # fmt: skip
    (fault,) = [line for line in done.stderr.splitlines() if line.startswith("boom_twin replay: ")]
    assert done.returncode == 1 and "cannot be written (File too large). Make room" in fault and "Traceback" not in done.stderr
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
