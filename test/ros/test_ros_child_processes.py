"""What the node, the recorder and the demonstration start runs nothing of the folder that they are started in."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hostile import Trap

pytest.importorskip("rclpy")
pytest.importorskip("aiohttp")

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
