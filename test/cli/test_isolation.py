"""No module of the working directory, nor of a session's folder, runs in a child process."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest
from health.recorded import written
from hostile import Trap

import boom_twin
from boom_twin.monitor.actions import RecorderProcess

PACKAGE = Path(boom_twin.__file__).parent
BUNDLED = PACKAGE.parent / "bags" / "arch_session"
COMMAND = [sys.executable, "-P", "-m", "boom_twin.cli.main"]  # as the console script: no working directory on sys.path


@pytest.fixture
def trap(tmp_path: Path) -> Trap:
    """A received session with hostile modules beside it and in it; both are worked in."""
    shutil.copytree(BUNDLED, tmp_path / "received" / "bag")
    return trap_of(tmp_path)


def trap_of(folder: Path) -> Trap:
    """Hostile modules around the session in ``received/bag``."""
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


def test_the_page_of_a_session_runs_nothing_of_the_folder(trap: Trap, tmp_path: Path) -> None:
    pytest.importorskip("aiohttp")
    command, log = [*COMMAND, "monitor", "--bag", "bag", "--port", "0"], tmp_path / "log"
    with log.open("w") as file, subprocess.Popen(command, cwd=tmp_path / "received", stdout=file, stderr=file) as process:
        end = time.monotonic() + 240.0
        while "open http" not in log.read_text() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.1)
        process.terminate()
    assert trap.sprung() == "" and "open http" in log.read_text(), log.read_text()


def test_a_recorder_of_the_page_runs_nothing_of_the_folder(trap: Trap, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path / "received")
    (tmp_path / "taken").write_text("")  # it ends at once: it cannot make its folder there
    recording = RecorderProcess(tmp_path / "taken")
    recording.start()
    assert recording._process is not None and recording._process.wait(240.0) == 1
    assert trap.sprung() == ""


def told_by(child_of: str, code: str, folder: Path, variables: dict[str, str]) -> str:
    """What a parent says whose program is `code`."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"} | variables
    program = f"{code}\nimport subprocess\nfrom boom_twin.system.child_process import python_command\n" + child_of
    return subprocess.check_output([sys.executable, "-P", "-c", program], cwd=folder, env=environment, text=True, timeout=100)


VERSION = "print(subprocess.run(python_command('boom_twin.cli.main', '--version'), capture_output=True, text=True).stdout)"


@pytest.mark.parametrize("way", ["PYTHONPATH", "sys.path", "relative sys.path", "zip"])
def test_a_child_has_its_parents_package(trap: Trap, tmp_path: Path, way: str) -> None:
    """However the parent came by it, and not the one that is installed."""
    there = tmp_path / "elsewhere"
    shutil.copytree(PACKAGE, there / "boom_twin", ignore=shutil.ignore_patterns("__pycache__"))
    (there / "boom_twin" / "__init__.py").write_text('__version__ = "the parents own"\n')
    if way == "zip":
        with zipfile.ZipFile(tmp_path / "package.zip", "w") as archive:
            for path in (there / "boom_twin").rglob("*.py"):
                archive.write(path, path.relative_to(there))
    places = {"sys.path": str(there), "relative sys.path": "../elsewhere", "zip": str(tmp_path / "package.zip")}
    code = f"import sys; sys.path.insert(0, {places[way]!r})" if way in places else ""
    variables = {"PYTHONPATH": str(there)} if way == "PYTHONPATH" else {}
    assert "the parents own" in told_by(VERSION, code, tmp_path / "received", variables)
    assert trap.sprung() == ""


def test_a_childs_path_is_its_parents(tmp_path: Path) -> None:
    """Neither the working directory nor the folder that the package is in is on it; what PYTHONPATH names is."""
    package = tmp_path / "elsewhere" / "boom_twin"
    package.mkdir(parents=True)
    (package / "system").mkdir()
    for name in ("__init__.py", "system/__init__.py", "system/child_process.py"):
        shutil.copy(PACKAGE / name, package / name)
    (package / "show.py").write_text("import json, sys\nprint(json.dumps(sys.path))\n")
    code = f"import json, sys; plain = list(sys.path); sys.path.insert(0, {str(package.parent)!r})"
    shown = "child = subprocess.check_output(python_command('boom_twin.show'))\nprint(json.dumps([plain, json.loads(child)]))"
    plain, child = json.loads(told_by(shown, code, tmp_path, {"PYTHONPATH": str(tmp_path / "named")}))
    assert child == plain and str(tmp_path / "named") in child
    assert not {"", str(tmp_path), str(package.parent)} & set(child)


def test_settings_of_numba_in_the_folder_are_refused(tmp_path: Path) -> None:
    (tmp_path / ".numba_config.yaml").write_text("disable_jit: 1\ncache_dir: here\n")
    command = [*COMMAND, "statics", "--posture", "arch"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert f"{tmp_path / '.numba_config.yaml'}: would change how the model is compiled" in done.stderr
