"""What the processes of a run share is made once, and is each one's own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from made_once import MadeOnce

WORKER = """
import os, sys, time
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from made_once import MadeOnce

def make(folder):
    time.sleep(0.3)  # the others come meanwhile
    (folder / "by").write_text(str(os.getpid()))

own = Path(sys.argv[3])
print((MadeOnce(Path(sys.argv[2])).folder("thing", make, own) / "by").read_text())
(own / "by").write_text("spoilt")
"""


def test_several_processes_make_a_thing_once_and_none_spoils_it(tmp_path: Path) -> None:
    arguments = [sys.executable, "-c", WORKER, str(Path(__file__).parent), str(tmp_path / "store")]
    children = [subprocess.Popen([*arguments, str(tmp_path / str(k))], stdout=subprocess.PIPE, text=True) for k in range(3)]
    told = {child.communicate(timeout=100)[0].strip() for child in children}
    assert len(told) == 1 and told <= {str(child.pid) for child in children}


def test_a_value_is_made_once_and_handed_out_anew(tmp_path: Path) -> None:
    made: list[list[int]] = []
    one = MadeOnce(tmp_path / "store").value("list", lambda: made.append([]) or [1, 2])
    one.append(3)
    assert MadeOnce(tmp_path / "store").value("list", lambda: made.append([]) or [4]) == [1, 2] and len(made) == 1


def test_what_failed_is_made_by_the_next_one(tmp_path: Path) -> None:
    shared = MadeOnce(tmp_path / "store")

    def fails(folder: Path) -> None:
        (folder / "half").write_text("")
        raise ValueError("a disk that is full")

    with pytest.raises(ValueError, match="full"):
        shared.folder("thing", fails, tmp_path / "one")
    whole = shared.folder("thing", lambda folder: (folder / "whole").write_text(""), tmp_path / "two")
    assert [path.name for path in whole.iterdir()] == ["whole"]


def test_a_run_has_its_own_store(made_once: MadeOnce, tmp_path_factory: pytest.TempPathFactory) -> None:
    base = tmp_path_factory.getbasetemp()
    assert made_once._store.name == "made_once" and made_once._store.parent in (base, base.parent)
