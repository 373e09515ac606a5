"""The live page that the node starts: it comes and goes with the node, and runs nothing of the folder."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("aiohttp")

from eventually import eventually
from hostile import Trap
from lifecycle_msgs.msg import Transition
from ros_rig import Rig


def gone(pid: int) -> None:
    """Wait until a process has ended."""

    def is_gone() -> None:
        path = Path(f"/proc/{pid}/stat")
        assert not path.exists() or " Z " in path.read_text()

    eventually(is_gone, 60.0)


def test_a_killed_page_changes_nothing_and_another_comes_and_goes_with_the_configuration(
    spawn_node: Callable[..., Any], reliable: list[str], new_rig: Callable[..., Rig], remote: Any
) -> None:
    watched = spawn_node("-p", "monitor:=true", *reliable)
    watched.wait_for("active;")
    watched.wait_for("open http")
    assert b"boom twin" in urlopen(re.search(r"open (http\S+)", watched.said())[1]).read()  # type: ignore[index]
    (page,) = watched.children
    rig = new_rig()
    rig.until(lambda: bool(rig.answers), rig.send)
    rig.until(lambda: rig.answers[-1][0] == rig.stamp)
    os.kill(page, signal.SIGKILL)
    first = len(rig.answers)
    rig.until(lambda: "the monitor ended with -9" in watched.said(), rig.send)
    rig.until(lambda: rig.answers[-1][0] == rig.stamp)
    stamps = [stamp for stamp, _ in rig.answers[first - 1 :]]
    assert {after - before for before, after in pairwise(stamps)} == {5_000_000}  # none is left out
    assert remote.change(Transition.TRANSITION_DEACTIVATE) and remote.change(Transition.TRANSITION_CLEANUP)
    assert remote.change(Transition.TRANSITION_CONFIGURE)
    (page,) = watched.children
    assert remote.change(Transition.TRANSITION_CLEANUP)
    gone(page)
    assert remote.set("monitor", False).successful and remote.change(Transition.TRANSITION_CONFIGURE)
    assert not watched.children and watched.said().count("the monitor ended") == 1 and watched.stop() == 0


PROFILES = """<?xml version="1.0" encoding="UTF-8" ?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <log>
    <use_default>FALSE</use_default>
    <consumer><class>FileConsumer</class><property><name>filename</name><value>OVERWRITTEN</value></property></consumer>
  </log>
  <profiles><participant profile_name="own" is_default_profile="true"><domainId>7</domainId></participant></profiles>
</dds>
"""


@pytest.fixture
def trap(tmp_path: Path, bag: Path, monkeypatch: pytest.MonkeyPatch) -> Trap:
    """A received folder to work in; programs are started as the console script is, without it on their path."""
    made = Trap(tmp_path / "received", tmp_path / "traces")
    (tmp_path / "received" / "bag").symlink_to(bag)
    (tmp_path / "received" / "DEFAULT_FASTRTPS_PROFILES.xml").write_text(
        PROFILES.replace("OVERWRITTEN", str(tmp_path / "overwritten"))
    )
    monkeypatch.chdir(tmp_path / "received")
    monkeypatch.setenv("PYTHONSAFEPATH", "1")
    return made


@pytest.fixture
def loud(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Takes PYTHONSAFEPATH away from children: they must keep the folder off by themselves."""
    (tmp_path / "start.py").write_text(
        "import os, sys, runpy\nos.environ.pop('PYTHONSAFEPATH')\n"
        "sys.argv = sys.argv[1:]\nrunpy.run_module(sys.argv[0], run_name='__main__', alter_sys=True)\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)


def test_the_page_of_the_node(spawn: Callable[..., Any], trap: Trap, loud: None, tmp_path: Path) -> None:
    node = spawn("start", "boom_twin.ros.node.main", "--ros-args", "-p", "monitor:=true")
    node.wait_for("open http")
    assert node.stop() == 0 and trap.sprung() == "", node.said()
    assert not (tmp_path / "overwritten").exists()
