"""Compiled kernels on disk: nobody else can have written them, they are whole, and they are of these sources."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from command import main

from boom_twin.kernels import compiled_cache as kernel_cache
from boom_twin.kernels.compiled_cache import ROOT, cache_folder, fault_of, read_checked, source_hash, write_checked

PROGRAM = """
import logging, sys
{before}
from boom_twin.kernels.jit import inner, kernel
@inner
def twice(x):
    return 2.0 * x
@kernel
def add(x, y):
    return twice(x) + y
found = add(1.0, 2.0), add(1, 2)
hits = getattr(add.dispatcher, "_cache_hits", None)
print(found, "loaded", 0 if hits is None else sum(hits.values()))
"""

CALLER = """
@{by}
def add_three(x, y, z):
    return add(add(x, y), z)
print(add_three(1.0, 2.0, 3.0))
"""


def run(folder: Path, before: str = "", after: str = "") -> subprocess.CompletedProcess[str]:
    """A process that calls a kernel twice, once for every type; its cache is in `folder`."""
    script = folder.parent / "program.py"
    script.write_text(PROGRAM.format(before=before) + after)
    command, environment = [sys.executable, str(script)], os.environ | {"NUMBA_CACHE_DIR": str(folder)}
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)


def told(done: subprocess.CompletedProcess[str]) -> str:
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the process above keeps."""
    folder = tmp_path_factory.mktemp("compiled") / "cache"
    run(folder)
    return folder


def test_what_one_process_compiled_another_loads(tmp_path: Path) -> None:
    first, second = run(tmp_path / "cache"), run(tmp_path / "cache")
    assert told(first) == "(4.0, 4.0) loaded 0" and told(second) == "(4.0, 4.0) loaded 2"
    assert "compiling the model" in first.stderr and "compiling" not in second.stderr
    (folder,) = (tmp_path / "cache").iterdir()
    assert folder.stat().st_mode & 0o777 == 0o700
    assert {path.suffix for path in folder.iterdir()} == {".kernel", ".user"}


LOST = """
from numba.core.codegen import JITCodeLibrary
JITCodeLibrary._object_compiled_hook = classmethod(lambda cls, module, data: None)
"""


def test_machine_code_whose_handing_over_was_interrupted_is_used_and_not_kept(tmp_path: Path) -> None:
    """A signal that comes while LLVM hands it over raises there, in a callback of C, where every exception is lost."""
    done = run(tmp_path / "cache", before=LOST)
    assert told(done) == "(4.0, 4.0) loaded 0" and "Traceback" not in done.stderr
    assert list((tmp_path / "cache").glob("*/*.kernel")) == []


@pytest.mark.parametrize("by", ["kernel", "__import__('numba').njit"])
def test_a_loaded_kernel_can_be_called_by_what_is_compiled(tmp_path: Path, compiled: Path, by: str) -> None:
    shutil.copytree(compiled, tmp_path / "cache")
    done = run(tmp_path / "cache", after=CALLER.format(by=by))
    assert told(done).splitlines() == ["(4.0, 4.0) loaded 2", "11.0"]


def test_caches_that_no_installation_uses_are_removed_with_a_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    names = ("earlier", "shared", "of_others", "unknown", "forgotten")
    caches = {name: tmp_path / f"{place:016x}" for place, name in enumerate(names)}
    for folder in caches.values():
        folder.mkdir(mode=0o700)
        write_checked(folder / "add.kernel", b"code")
    kernel_cache.claim(caches["shared"])
    (own,) = caches["shared"].glob("*.user")
    shutil.copy(own, caches["earlier"])
    for name in ("shared", "of_others"):
        write_checked(caches[name] / "other.user", str(tmp_path).encode())
    write_checked(caches["forgotten"] / "gone.user", b"/gone")
    os.utime(caches["forgotten"], (0.0, 0.0))
    new = cache_folder()
    new.mkdir(mode=0o700)
    kernel_cache.claim(new)
    assert {name for name, folder in caches.items() if folder.exists()} == {"shared", "of_others", "unknown"}
    assert not own.exists() and len(list(new.glob("*.user"))) == 1
    (tmp_path / "index").mkdir()
    assert main(["warm", "--remove"]) == 0 and "removed 4 folders of compiled kernels" in capsys.readouterr().out
    assert [each.name for each in tmp_path.iterdir()] == ["index"]


def test_warm_says_where_the_kernels_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["warm"]) == 0 and main(["warm"]) == 0
    assert f"kernels in {cache_folder()}" in (out := capsys.readouterr().out) and "nothing to compile" in out


def harmed(path: Path, harm: str) -> None:
    """Do something to a file that `write_checked` wrote."""
    data = path.read_bytes()
    half = len(data) // 2
    contents = {
        "cut": data[:half],
        "empty": b"",
        "flipped": data[:half] + bytes([data[half] ^ 1]) + data[half + 1 :],
        "garbage": os.urandom(9000),
        "bare": data[32:],
    }
    if harm == "writable":
        path.chmod(0o666)
        return
    path.unlink()
    if harm == "link":
        path.with_suffix(".there").write_bytes(data)
        path.symlink_to(path.with_suffix(".there"))
    elif harm == "fifo":
        os.mkfifo(path)
    elif harm == "folder":
        path.mkdir()
    else:
        path.write_bytes(contents[harm])


@pytest.mark.parametrize("harm", ["cut", "empty", "flipped", "garbage", "bare", "writable", "link", "fifo", "folder"])
def test_a_file_that_is_not_as_it_was_written_is_not_read(tmp_path: Path, harm: str) -> None:
    write_checked(tmp_path / "file", b"something" * 1000)
    assert read_checked(tmp_path / "file") == b"something" * 1000
    harmed(tmp_path / "file", harm)
    assert read_checked(tmp_path / "file") is None


@pytest.mark.parametrize("harm", ["flipped", "folder"])
def test_code_that_is_not_as_it_was_written_is_compiled_anew(tmp_path: Path, compiled: Path, harm: str) -> None:
    shutil.copytree(compiled, tmp_path / "cache")
    (folder,) = (tmp_path / "cache").iterdir()
    for path in list(folder.iterdir()):
        harmed(path, harm)
    assert told(run(tmp_path / "cache")) == "(4.0, 4.0) loaded 0"
    assert told(run(tmp_path / "cache")) == f"(4.0, 4.0) loaded {0 if harm == 'folder' else 2}"


@pytest.mark.parametrize("place", [".", ".."])
def test_a_folder_that_others_can_write_is_not_used(tmp_path: Path, compiled: Path, place: str) -> None:
    shutil.copytree(compiled, tmp_path / "shared" / "cache")
    (folder,) = (tmp_path / "shared" / "cache").iterdir()
    before = sorted(folder.iterdir())
    (folder / place).resolve().chmod(0o777)
    done = run(tmp_path / "shared" / "cache")
    assert told(done) == "(4.0, 4.0) loaded 0"
    assert done.stderr.count("compiled code is not kept") == 1 and "can be written by others: `chmod go-w` it" in done.stderr
    assert sorted(folder.iterdir()) == before


def test_a_sticky_folder_may_be_above_it_but_not_it(tmp_path: Path) -> None:
    """As /tmp is: others can add entries, but not exchange those of the user."""
    (tmp_path / "tmp").mkdir()
    (tmp_path / "tmp").chmod(0o1777)
    assert fault_of(tmp_path / "tmp" / "own") is None
    assert "can be written by others" in str(fault_of(tmp_path / "tmp"))


def test_a_place_that_cannot_be_used_is_told_and_the_model_runs(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    done = run(tmp_path / "taken")
    assert told(done) == "(4.0, 4.0) loaded 0" and "Not a directory" in done.stderr
    assert "relative path" in str(fault_of(Path("somewhere")))
    assert not Path("somewhere").exists()


def test_all_kernels_are_in_the_sources_that_are_hashed() -> None:
    kernels = [path for path in ROOT.rglob("*.py") if re.search(r"^@(kernel|inner)$", path.read_text(), re.M)]
    assert len(kernels) > 15
    sources = [ROOT / name for name in kernel_cache.KERNEL_SOURCES]
    assert [path for path in kernels if not any(path.is_relative_to(source) for source in sources)] == []


def test_the_hash_of_the_sources_counts_everywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An edit of any kernel source, in any depth of folders, gives another folder; with NUMBA_CACHE_DIR too."""
    for name in kernel_cache.KERNEL_SOURCES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, tmp_path / name)
    before = source_hash(tmp_path)
    assert before == source_hash()
    (tmp_path / "kernels" / "deeper").mkdir()
    (tmp_path / "kernels" / "deeper" / "step.py").write_text("a = 1\n")
    deeper = source_hash(tmp_path)
    (tmp_path / "kernels" / "deeper" / "step.py").write_text("a = 2\n")
    (tmp_path / "kernels" / "other").mkdir()
    edited = source_hash(tmp_path)
    (tmp_path / "kernels" / "deeper" / "step.py").rename(tmp_path / "kernels" / "other" / "step.py")
    assert len({before, deeper, edited, source_hash(tmp_path)}) == 4
    (tmp_path / "types.py").write_text("NANO = 1e-9\n")
    assert source_hash(tmp_path) != edited
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv(kernel_cache.NO_COLOURS, "1")  # of messages: the code is the same
    assert cache_folder() == tmp_path / before
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "1")
    assert cache_folder() != tmp_path / before


def test_a_numba_that_changed_inside_compiles_all_the_same(tmp_path: Path) -> None:
    done = run(tmp_path / "cache", "import numba.core.compiler as c; del c.CompileResult._reduce")
    assert told(done) == "(4.0, 4.0) loaded 0"
    assert "is not the one that was tested" in done.stderr
