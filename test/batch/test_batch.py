"""A batch of small sessions: a broken one, a killed process, Ctrl-C, damaged rows, and going on."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from health.recorded import written
from page_outline import outline

psutil, parquet = pytest.importorskip("psutil"), pytest.importorskip("pyarrow.parquet")
LocalCluster = pytest.importorskip("distributed").LocalCluster


from command import main  # noqa: E402

from boom_twin import replay  # noqa: E402
from boom_twin.system.processes import python_command  # noqa: E402

COUNT = 5
PATIENCE = 300.0
Done = tuple[Path, dict[str, int], list[psutil.Process]]


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five of two seconds, and one that was cut off."""
    folder = tmp_path_factory.mktemp("sessions")
    written(folder / "s0", 2.0)
    for number in range(1, COUNT):
        shutil.copytree(folder / "s0", folder / f"s{number}")
    (folder / "torn").mkdir()
    whole = (folder / "s0" / "session_0.mcap").read_bytes()
    (folder / "torn" / "session_0.mcap").write_bytes(whole[: len(whole) // 2])
    return folder


def started(sessions: Path, out: Path, *options: str) -> subprocess.Popen[str]:
    arguments = "batch", str(sessions / "*"), "--out", str(out), "--workers", "2", *options
    command = python_command("boom_twin.cli.main", *arguments)
    return subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def rows_in(out: Path) -> list[Path]:
    return sorted((out / "rows").glob("*.json"))


def wait_for_rows(process: subprocess.Popen[str], out: Path, count: int) -> None:
    end = time.monotonic() + PATIENCE
    while len(rows_in(out)) < count:
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.02)


def is_of_session(process: psutil.Process) -> bool:
    with suppress(psutil.Error):
        return any("session_task" in word for word in process.cmdline())
    return False


def listening(process: subprocess.Popen[str]) -> list[object]:
    """The ports that a process and its children listen on."""
    family = [psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)]
    found = []
    for each in family:
        with suppress(psutil.Error):
            found += [link.laddr for link in each.net_connections() if link.status == psutil.CONN_LISTEN]
    return found


@pytest.fixture(scope="module")
def done(sessions: Path, tmp_path_factory: pytest.TempPathFactory) -> Done:
    """Folder of a batch that lost a process, was stopped, and went on; times of the rows when it was stopped; its processes."""
    out = tmp_path_factory.mktemp("batch") / "out"
    process = started(sessions, out)
    wait_for_rows(process, out, 1)
    end = time.monotonic() + PATIENCE
    while not (at_work := [each for each in psutil.Process(process.pid).children() if is_of_session(each)]):
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.02)
    assert listening(process) == []  # whoever reaches a scheduler's port can run code
    at_work[-1].kill()
    while not any("by signal 9" in path.read_text() for path in rows_in(out)):
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.02)
    family = psutil.Process(process.pid).children(recursive=True)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=PATIENCE)
    assert process.returncode == 1 and told.splitlines()[-1] == "boom_twin batch: stopped", told
    assert json.loads((out / "batch.json").read_text())["state"].startswith("unfinished")
    assert not (out / "sessions.parquet").exists()
    kept = {path.name: path.stat().st_mtime_ns for path in rows_in(out) if json.loads(path.read_text())["status"] == "ok"}
    again = started(sessions, out, "--retry-failed")
    _, told = again.communicate(timeout=PATIENCE)
    assert again.returncode == 1 and f"{len(kept)} of {COUNT + 1} sessions are done" in told, told
    return out, kept, family


def test_going_on_repeats_nothing(done: Done) -> None:
    out, kept, family = done
    assert 1 <= len(kept) < COUNT
    assert {name: time for path in rows_in(out) if (name := path.name) in kept for time in [path.stat().st_mtime_ns]} == kept
    assert json.loads((out / "batch.json").read_text())["state"] == "complete"
    _, alive = psutil.wait_procs(family, timeout=60)
    assert not [each for each in alive if each.status() != psutil.STATUS_ZOMBIE]


def test_rows_are_those_of_single_replays(sessions: Path, done: Done, tmp_path: Path) -> None:
    table = parquet.read_table(done[0] / "sessions.parquet").to_pylist()
    right = [row for row in table if row["status"] == "ok"]
    assert len(table) == COUNT + 1 and {row["session"] for row in right} == {f"s{number}" for number in range(COUNT)}
    summary = replay(sessions / "s0", None, tmp_path / "one").summary
    for row in right:
        for name in ("output_sha256", "samples", "joint_residual_rms_rad", "scene_sha256", "tip_acceleration_max_m_s2"):
            assert row[name] == summary[name], name
        assert row["alarms"] == [] and row["version"] and row["residual_rms_joint_1"] > 0.0 and len(row["file_sha256"]) == 64


def test_a_session_that_needs_more_memory_than_it_may_have_fails(sessions: Path, tmp_path: Path) -> None:
    assert main(["batch", str(sessions / "s0"), "--memory", "60", "--out", str(tmp_path / "out")]) == 1
    (row,) = parquet.read_table(tmp_path / "out" / "sessions.parquet").to_pylist()
    assert row["status"] == "failed", row


def test_a_cluster_gives_the_same_rows(sessions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=None) as cluster:
        found = [str(sessions / "s0"), str(sessions / "torn"), "--out", str(tmp_path / "out")]
        assert main(["batch", *found, "--scheduler", cluster.scheduler_address]) == 1, capsys.readouterr()
    right, wrong = parquet.read_table(tmp_path / "out" / "sessions.parquet").to_pylist()
    assert (right["status"], right["samples"]) == ("ok", 401) and "the end is missing" in wrong["reason"]


def test_a_broken_session_costs_its_own_row(done: Done) -> None:
    (row,) = [row for row in parquet.read_table(done[0] / "sessions.parquet").to_pylist() if row["status"] != "ok"]
    assert row["session"] == "torn" and row["status"] == "failed"
    assert "incomplete: the end is missing" in row["reason"]


def test_topics_of_a_node_in_another_namespace_are_missed(
    sessions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    session, front = str(sessions / "s0"), ("--namespace", "front")
    assert main(["batch", session, "--out", str(tmp_path / "out"), *front]) == 1
    assert main(["compare", session, session, *front]) == 1
    assert [text.count("/front/cylinder_strokes") > 0 for text in capsys.readouterr()] == [True, True]


def test_the_page_needs_nothing_from_elsewhere(done: Done) -> None:
    text = (done[0] / "batch.html").read_text(encoding="utf-8")
    found = outline(done[0] / "batch.html")
    assert found.sources and all(link.startswith("data:image/png;base64,") for link in found.sources)
    written = re.sub('base64,[^"]*', "", text)
    assert "http" not in written and not re.search(r"url\(|@import|fetch\(", written)
    assert found.tags.count("tr") == COUNT + 4 and "Counted once: 4 sessions" in text, "the sessions are copies of one"
    assert "Damage is not known: give --fatigue" in text and "residual_rms_joint_1, rad" in written
    assert '<div class="sorted"><table' in text, "the table scrolls by itself where the screen is narrower"


def test_a_finished_batch_starts_no_session(sessions: Path, done: Done, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["batch", str(sessions / "s*"), str(sessions / "torn"), "--out", str(done[0])]) == 1
    told = capsys.readouterr()
    assert "sessions are done" not in told.err and f"{COUNT} sessions right, 1 failed" in told.out


@pytest.mark.parametrize("damage", [lambda text: text[: len(text) // 2], lambda _: "", lambda _: "[1]", lambda _: "{}"])
def test_a_session_whose_row_is_damaged_is_done_anew(sessions: Path, tmp_path: Path, damage: Callable[[str], str]) -> None:
    out = tmp_path / "out"
    arguments = ["batch", str(sessions / "none"), str(sessions / "torn"), "--out", str(out)]
    assert main(arguments) == 1
    first, other = rows_in(out)
    before, other_time = first.read_text(), other.stat().st_mtime_ns
    first.write_text(damage(before))
    assert main(arguments) == 1
    assert json.loads(first.read_text())["reason"] == json.loads(before)["reason"]
    assert other.stat().st_mtime_ns == other_time and parquet.read_table(out / "sessions.parquet").num_rows == 2


def test_a_name_that_is_not_utf_8_costs_no_row(sessions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    odd = os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9")
    shutil.copytree(sessions / "s0", odd)
    out = tmp_path / "out"
    assert main(["batch", odd, str(sessions / "torn"), "--out", str(out)]) == 1
    rows = {row["session"]: row["status"] for row in parquet.read_table(out / "sessions.parquet").to_pylist()}
    assert rows == {"caf?": "ok", "torn": "failed"}, capsys.readouterr()
    assert "caf?" in (out / "batch.html").read_text(encoding="utf-8")
