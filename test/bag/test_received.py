"""A session's folder from somebody else: what is no file of its own in it is refused by name, and not opened."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from command import main
from recordings import TRUTH, load_truth, mapping_of, recover, scan

from boom_twin import BagError
from boom_twin.report.quantities import FILE_NAME as QUANTITIES
from boom_twin.report.quantities import read, side_of
from boom_twin.system.files import open_received

MCAP, METADATA, SESSION_YAML, SUMMARY = "session_0.mcap", "metadata.yaml", "session.yaml", "summary.json"
LINK = "a symbolic link"
KINDS = {"link": LINK, "loose link": LINK, "pipe": "a named pipe", "socket": "a socket", "folder": "a directory"}


def put(path: Path, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace a file by something else under its name."""
    elsewhere = path.parents[1] / f"elsewhere_{path.name}"
    if path.is_file():
        path.rename(elsewhere)
    elif kind == "link":
        elsewhere.write_text("mapping: ''\n")
    if kind == "link":
        path.symlink_to(elsewhere)
    elif kind == "loose link":
        path.symlink_to(path.parent / "nothing")
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        monkeypatch.chdir(path.parent)  # names of sockets are short
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_what_is_no_file_is_refused_by_its_name(bag: Path, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a bag, in it, and in the folder of a replay."""

    def refused(path: Path, *readers: Callable[[], Any]) -> None:
        put(path, kind, monkeypatch)
        for reader in readers:
            with pytest.raises(BagError, match=f"{path}: {KINDS[kind]}"):
                reader()

    def rescue() -> Any:
        return recover(bag, tmp_path / "out")

    result = tmp_path / "replay"
    result.mkdir()
    refused(result / SUMMARY, lambda: side_of(result, lambda path: path))
    refused(result / QUANTITIES, lambda: read(result))
    refused(bag / TRUTH, lambda: load_truth(bag))
    refused(bag / SESSION_YAML, lambda: mapping_of(bag), rescue)
    refused(bag / METADATA, lambda: scan(bag), rescue)
    (bag / METADATA).unlink() if kind != "folder" else (bag / METADATA).rmdir()
    refused(bag / MCAP, lambda: scan(bag), rescue)
    assert not (tmp_path / "out").exists()


COMMANDS = (
    (METADATA, ["info", "bag"]),
    (SESSION_YAML, ["replay", "bag", "--out", "out"]),
    (METADATA, ["monitor", "--bag", "bag", "--port", "0"]),
)


@pytest.mark.parametrize(("name", "arguments"), COMMANDS)
@pytest.mark.system
def test_a_command_refuses_a_device(bag: Path, name: str, arguments: list[str], tmp_path: Path) -> None:
    (bag / name).unlink(missing_ok=True)
    (bag / name).symlink_to("/dev/zero")
    program = [sys.executable, "-P", "-m", "boom_twin.cli.main", *arguments]
    done = subprocess.run(program, cwd=tmp_path, capture_output=True, text=True, timeout=200, check=False)
    assert done.returncode == 1 and f"bag/{name}: a symbolic link" in done.stderr and "Traceback" not in done.stderr


def test_what_the_user_names_may_be_a_link(bag: Path, tmp_path: Path) -> None:
    (tmp_path / "linked").symlink_to(bag)
    (tmp_path / "linked.mcap").symlink_to(bag / MCAP)
    assert len(scan(tmp_path / "linked").files) == len(scan(tmp_path / "linked.mcap").files) == 1
    assert main(["info", str(tmp_path / "linked")]) == main(["info", str(tmp_path / "linked.mcap")]) == 0
    shutil.copy(bag / MCAP, tmp_path / "received.mcap")
    assert mapping_of(tmp_path / "received.mcap").source == mapping_of(bag).source


def test_a_file_that_is_exchanged_for_a_link_meanwhile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "secret").write_bytes(b"abc")
    (tmp_path / "a").symlink_to(tmp_path / "secret")
    monkeypatch.setattr("boom_twin.system.files.holds_file", lambda path: True)  # as it was when it was looked at
    with pytest.raises(OSError, match="symbolic links"):
        open_received(tmp_path / "a")


@pytest.mark.parametrize("command", [["info"], ["replay", "--out", "out"], ["recover", "--out", "out"]])
def test_links_that_lead_in_a_circle_are_told(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    assert main([command[0], "a", *command[1:]]) == 1
    assert "symbolic link" in (said := capsys.readouterr().err) and "Traceback" not in said
