"""A process with limits: whatever it does, its caller goes on and knows why it failed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

psutil = pytest.importorskip("psutil")

from boom_twin.batch.session_task import SessionProcess  # noqa: E402


def run(code: str, seconds: float = 120.0, *arguments: str) -> tuple[bytes, str]:
    process = SessionProcess([sys.executable, "-c", code, *arguments], b"task\n", seconds)
    while not process.is_over:
        time.sleep(0.05)
    return process.end()


def is_gone(pid: int) -> bool:
    for _ in range(600):
        if not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE:
            return True
        time.sleep(0.1)
    return False


def test_what_it_says_is_told() -> None:
    assert run("print(input())") == (b"task\n", "")
    assert run("import sys; sys.exit('this: is wrong')")[1] == "this: is wrong"
    assert run("raise ValueError('of a kind')")[1] == "ValueError: of a kind"
    assert run("import os; os.kill(os.getpid(), 9)")[1] == "its process was ended by signal 9"
    assert run("import os; os._exit(3)")[1] == "its process was ended by itself with code 3"


def test_one_that_hangs_is_ended_with_its_children(tmp_path: Path) -> None:
    code = (
        "import subprocess, sys, time; child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)']); "
        "open(sys.argv[1], 'w').write(str(child.pid)); time.sleep(600)"
    )
    _, reason = run(code, 8.0, str(tmp_path / "pid"))  # s; on a busy machine a process takes long to start
    assert reason == "takes longer than 8 s. Raise --timeout."
    assert is_gone(int((tmp_path / "pid").read_text()))


def test_it_ends_with_its_caller(tmp_path: Path) -> None:
    """The caller is killed, as a worker may be."""
    child = (
        "import os, sys, time; from boom_twin.batch.session_task import end_with_caller; sys.stdin.readline(); "
        "end_with_caller(); open(sys.argv[1], 'w').write(str(os.getpid())); time.sleep(600)"
    )
    caller = (
        "import sys, time; from boom_twin.batch.session_task import SessionProcess; "
        "kept = SessionProcess([sys.executable, '-c', sys.argv[1], sys.argv[2]], b'task\\n', 600.0); time.sleep(600)"
    )
    place = tmp_path / "pid"
    process = subprocess.Popen([sys.executable, "-c", caller, child, str(place)])
    while not (place.exists() and place.read_text()):
        assert process.poll() is None
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert is_gone(int(place.read_text()))
