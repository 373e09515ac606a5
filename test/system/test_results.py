"""Folders of results: what a kill at every single step leaves, who may write where, and that files are whole or old."""

from __future__ import annotations

import hashlib
import json
import os
import resource
import signal
import traceback
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from recordings import incompleteness

from boom_twin import BagError
from boom_twin.system.files import write_atomic
from boom_twin.system.result_folder import RECOVER, REPLAY, RIG, ResultKind, result_folder

FILES = ("summary.json", "quantities.json", "bag/session_0.mcap")
CHANGING = ("open", "mkdir", "rename", "replace", "unlink", "rmdir", "fsync", "pwrite", "truncate")
"""What a program calls to change a disk."""


def run(out: Path, content: str, steps: int = -1) -> int:
    """A process that writes a result, ended by SIGKILL before its step of that number; its exit code."""
    if child := os.fork():
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    left = iter(range(steps, -2, -1) if steps >= 0 else count(1))

    def counted(act: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            if next(left) == 0:
                os.kill(os.getpid(), signal.SIGKILL)
            return act(*arguments, **options)

        return call

    try:
        for name in CHANGING:
            setattr(os, name, counted(getattr(os, name)))
        with result_folder(out, REPLAY, []) as building:
            (building / "bag").mkdir()
            for name in FILES:
                write_atomic(building / name, name + content)
        os._exit(0)
    except BaseException:
        traceback.print_exc()
        os._exit(1)


def content_of(folder: Path) -> str | None:
    """The word that all files of a whole result have behind their names."""
    if not folder.exists():
        return None
    assert set(json.loads((folder / "manifest.json").read_text())["files"]) == set(FILES)
    (word,) = {(folder / name).read_text().removeprefix(name) for name in FILES}
    return word


@pytest.mark.system
def test_a_kill_at_any_step_leaves_a_whole_result_or_one_that_says_it_is_not(tmp_path: Path) -> None:
    """Every step of replacing an earlier result, one after the other; the next run leaves the folder of a killed one."""
    for steps in range(200):
        out = tmp_path / str(steps) / "out"
        beside = [out.with_name(f"out.{name}") for name in ("unfinished", "replaced")]
        assert run(out, "old") == 0
        code = run(out, "new", steps)
        assert code in (0, -signal.SIGKILL)
        found = [content_of(folder) for folder in (out, beside[1]) if (folder / "manifest.json").exists()]
        whole = content_of(beside[0]) if (beside[0] / "manifest.json").exists() else None
        assert content_of(out) in ("old", "new") or ("old" in found and whole == "new"), steps
        for folder in beside:
            if folder.exists() and not (folder / "manifest.json").exists() and any(folder.iterdir()):
                assert incompleteness(folder).startswith("incomplete") and incompleteness(folder / "bag"), steps
        assert not incompleteness(out)
        left = sorted(beside[0].rglob("*"))
        assert run(out, "next") == 0 and content_of(out) == "next"
        assert {path.name for path in out.parent.iterdir()} <= {"out", "out.unfinished"}, steps
        assert sorted(beside[0].rglob("*")) == left
        if code == 0:
            assert steps > 40
            return
    pytest.fail("it took more steps than were tried")


def build(out: Path, kind: ResultKind = REPLAY, sources: tuple[Path, ...] = (), name: str = "summary.json") -> None:
    with result_folder(out, kind, sources) as building:
        write_atomic(building / name, "{}")


def test_of_two_at_once_each_has_a_folder_of_its_own(tmp_path: Path) -> None:
    """The one that ends last replaces the other's result; a recording is kept beside it."""
    with result_folder(tmp_path / "out", REPLAY, []) as building:
        build(tmp_path / "out")
        write_atomic(building / "summary.json", "later")
    assert (tmp_path / "out" / "summary.json").read_text() == "later"
    with (
        pytest.raises(BagError, match=r"nothing is written over.*The result is whole, and is kept in .*rec\.unfinished"),
        result_folder(tmp_path / "rec", RIG, []) as building,
    ):
        build(tmp_path / "rec", RIG, name="session_0.mcap")
        write_atomic(building / "session_0.mcap", "later")
    assert {path.name for path in tmp_path.iterdir()} == {"out", "rec", "rec.unfinished"}


def recording(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "session_0.mcap").write_bytes(b"a recording")


def listed(folder: Path, files: dict[str, str]) -> None:
    """A recording with the manifest of a replay that lists these files."""
    recording(folder)
    (folder / "manifest.json").write_text(json.dumps({"command": "replay", "files": files}))


DIGEST = hashlib.sha256(b"a recording").hexdigest()
FOREIGN: dict[str, Callable[[Path], Any]] = {
    "a recording": recording,
    "a recording in bag": lambda folder: recording(folder / "bag"),
    "a result of 0.1.0": lambda folder: (recording(folder / "bag"), (folder / "summary.json").write_text("{}")),
    "an empty folder inside": lambda folder: (folder / "notes").mkdir(parents=True),
    "a hidden file": lambda folder: (build(folder), (folder / ".hidden").write_text("")),
    "a link": lambda folder: (build(folder), (folder / "link").symlink_to("/")),
    "a result that was edited": lambda folder: (build(folder), (folder / "summary.json").write_text("{} ")),
    "another command's": lambda folder: build(folder, RIG, name="session_0.mcap"),
    "a manifest that lies": lambda folder: listed(folder, {"../precious": "", "session_0.mcap": "00"}),
    "a manifest that was forged": lambda folder: listed(folder, {"session_0.mcap": DIGEST}),
    "a manifest of another shape": lambda folder: (folder.mkdir(), (folder / "manifest.json").write_text("[[]]")),
}


@pytest.mark.parametrize("place", ["out", "out.replaced"])
@pytest.mark.parametrize("make", FOREIGN.values(), ids=FOREIGN)
def test_nothing_but_an_earlier_result_is_replaced(tmp_path: Path, make: Callable[[Path], Any], place: str) -> None:
    (tmp_path / "precious").write_text("never touched")
    make(tmp_path / place)

    def state() -> dict[Path, bytes | None]:
        return {path: path.read_bytes() if path.is_file() else None for path in tmp_path.rglob("*")}

    before = state()
    with pytest.raises(BagError, match=rf"{place}: "):
        build(tmp_path / "out")
    assert state() == before


def test_what_is_beside_a_result_under_the_name_of_an_unfinished_one_is_left(tmp_path: Path) -> None:
    assert run(tmp_path / "out", "old", 12) == -signal.SIGKILL
    recording(tmp_path / "out.unfinished" / "mine")
    (tmp_path / "out.unfinished2").symlink_to(tmp_path / "nowhere")
    before = sorted((tmp_path / "out.unfinished").rglob("*"))
    build(tmp_path / "out")
    assert sorted((tmp_path / "out.unfinished").rglob("*")) == before
    assert {path.name for path in tmp_path.iterdir()} == {"out", "out.unfinished", "out.unfinished2"}


def test_a_disk_that_is_full_from_the_start_is_named_and_left_as_it_was(tmp_path: Path) -> None:
    """The limit on the size of a file stands for the disk's."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, before[1]))
    try:
        with (
            pytest.raises(BagError, match=r"out: cannot be written \(File too large\)\. Make room"),
            result_folder(tmp_path / "out", REPLAY, []),
        ):
            pass
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not list(tmp_path.iterdir())


def test_no_source_is_built_over(tmp_path: Path) -> None:
    recording(tmp_path / "mine")
    with pytest.raises(BagError, match="a source is never touched"):
        build(tmp_path, RIG, (tmp_path / "mine" / "session_0.mcap",), "session_0.mcap")


def test_a_session_that_could_not_be_put_in_place_is_not_thrown_away(tmp_path: Path) -> None:
    """Its source may be gone by now."""
    told = r"out: holds session_0\.mcap.*The result is whole, and is kept in .*out\.unfinished"
    with pytest.raises(BagError, match=told), result_folder(tmp_path / "out", RECOVER, []) as building:
        (building / "session_0.mcap").write_text("saved")
        recording(tmp_path / "out")
    (tmp_path / "out.unfinished").rename(tmp_path / "saved")
    assert (tmp_path / "saved" / "session_0.mcap").read_text() == "saved" and not incompleteness(tmp_path / "saved")


@pytest.mark.parametrize("place", ["out", "out.replaced"])
def test_a_file_that_a_source_links_to_is_not_removed(tmp_path: Path, place: str) -> None:
    """Also in what an earlier run left beside the result."""
    build(tmp_path / place)
    (tmp_path / place / "unfinished.json").write_text('{"command": "replay"}')
    (tmp_path / "source").mkdir()
    (tmp_path / "source" / "session_0.mcap").symlink_to(tmp_path / place / "summary.json")
    with pytest.raises(BagError, match=rf"{place}: its summary\.json is .*session_0\.mcap"):
        build(tmp_path / "out", sources=(tmp_path / "source",))
    assert (tmp_path / "source" / "session_0.mcap").exists()


def test_all_files_of_a_result_are_synced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced, real = list[str](), os.fsync
    monkeypatch.setattr(os, "fsync", lambda handle: (synced.append(os.readlink(f"/proc/self/fd/{handle}")), real(handle)))
    with result_folder(tmp_path / "out", REPLAY, []) as building:
        (building / "summary.json").write_text("{}")
    assert str(building / "summary.json") in synced


def test_a_file_is_the_old_one_or_the_new_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text("old")
    path.chmod(0o640)
    (tmp_path / "link").symlink_to(path)

    def fail(handle: int) -> None:
        raise OSError(28, "No space left on device")

    with (
        monkeypatch.context() as patch,
        pytest.raises(BagError, match=r"scene\.yaml: cannot be written \(No space left on device\)\. Make room"),
    ):
        patch.setattr(os, "fsync", fail)
        write_atomic(path, "new")
    assert path.read_text() == "old"
    write_atomic(tmp_path / "link", "new")
    assert path.read_text() == "new" and path.stat().st_mode & 0o777 == 0o640 and (tmp_path / "link").is_symlink()
    write_atomic(Path("/dev/null"), "anything")
    assert not Path("/dev/null").is_file() and {each.name for each in tmp_path.iterdir()} == {"scene.yaml", "link"}
