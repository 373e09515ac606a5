"""No module of the working directory, nor of a session's folder, runs in a child process."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from health.recorded import written
from hostile import Trap

import boom_twin

PACKAGE = Path(boom_twin.__file__).parent
BUNDLED = PACKAGE.parent / "bags" / "arch_session"
COMMAND = [sys.executable, "-P", "-m", "boom_twin.cli.main"]  # as the console script: no working directory on sys.path


def trap_of(folder: Path) -> Trap:
    """Hostile modules beside the session in ``received/bag`` and in it; both are worked in."""
    Trap(folder / "received" / "bag", folder / "traces")
    return Trap(folder / "received", folder / "traces")


@pytest.mark.parametrize("place", ["received", "received/bag"])
def test_a_replay_runs_nothing_of_the_folder(tmp_path: Path, place: str) -> None:
    bag = tmp_path / "received" / "bag"
    count, trap = written(bag, 2.0), trap_of(tmp_path)
    command = [*COMMAND, "replay", os.path.relpath(bag, tmp_path / place), "--out", str(tmp_path / "out")]
    done = subprocess.run(command, cwd=tmp_path / place, capture_output=True, text=True, timeout=600, check=False)
    assert trap.sprung() == ""
    assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["samples"] == count


def test_the_page_of_a_session_runs_nothing_of_the_folder(tmp_path: Path) -> None:
    pytest.importorskip("aiohttp")
    shutil.copytree(BUNDLED, tmp_path / "received" / "bag")
    trap = trap_of(tmp_path)
    command, log = [*COMMAND, "monitor", "--bag", "bag", "--port", "0"], tmp_path / "log"
    with log.open("w") as file, subprocess.Popen(command, cwd=tmp_path / "received", stdout=file, stderr=file) as process:
        end = time.monotonic() + 240.0
        while "open http" not in log.read_text() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.1)
        process.terminate()
    assert trap.sprung() == "" and "open http" in log.read_text(), log.read_text()


def test_settings_of_numba_in_the_folder_are_refused(tmp_path: Path) -> None:
    (tmp_path / ".numba_config.yaml").write_text("disable_jit: 1\ncache_dir: here\n")
    command = [*COMMAND, "statics", "--posture", "arch"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert f"{tmp_path / '.numba_config.yaml'}: would change how the model is compiled" in done.stderr
