"""Common to all tests: makes this folder importable, for the witnesses in ``oracle``; who runs what; what is shared."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zlib import crc32

import pytest

if TYPE_CHECKING:
    from demo.isolation import Isolation

sys.path.insert(0, str(Path(__file__).parent))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # several processes share the tests: its threads only wait for one another

from made_once import MadeOnce

FIRST = (
    "health/test_health_twin", "oracle/test_segments", "oracle/test_twin_against_rig", "report/test_compare",
    "ros/test_ros_demo", "ros/test_ros_two_booms", "ros/test_ros_page_live", "ros/test_ros_recording",
    "offline/test_replay_errors", "plots/test_pictures", "validation/study/test_need",
)  # fmt: skip
"""Files that take longest: begun first, or one process is left with one of them when the others are done."""


SYSTEM = (
    "batch/", "cli/test_isolation", "cli/test_start_up", "docs/test_examples",
    "extending/", "kernels/test_kernel_cache", "kernels/test_uncompiled", "monitor/test_monitor_browser",
    "monitor/test_monitor_connections", "ros/",
)  # fmt: skip
"""Folders and files whose tests start processes; single ones elsewhere have the mark themselves."""

USUAL = ("monitor/test_monitor_browser.py::test_the_first_glance", "ros/test_ros_messages", "ros/test_ros_layouts")
"""Run by `make test` all the same: one page in a browser, one round trip over DDS, and what starts no process."""


@pytest.hookimpl(tryfirst=True)  # before pytest selects by marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests of the whole system, and mix the files where several processes share the tests.

    Mixed, not all processes wait for a ROS node at a time.
    """
    for item in items:
        name = item.nodeid.removeprefix("test/")
        if name.startswith(SYSTEM) and not name.startswith(USUAL):
            item.add_marker("system")
    if "PYTEST_XDIST_WORKER" in os.environ:
        first = {f"test/{name}.py" for name in FIRST}
        items.sort(key=lambda item: (item.location[0] not in first, crc32(item.location[0].encode())))


@pytest.fixture(scope="session")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> MadeOnce:
    """What is made once for all processes of this run; in a folder that only this run has."""
    own = tmp_path_factory.getbasetemp()
    return MadeOnce((own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "made_once")


@pytest.fixture(scope="session")
def isolation() -> Iterator[Isolation]:
    """A ROS domain that only this process of the test run uses, closed to others.

    All that starts a ROS node in this process needs it: the middleware takes a process into a partition when its first node
    starts, and never again.
    """
    from demo.isolation import isolated

    with isolated() as claimed:
        yield claimed


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Debian's Chromium, driven by Playwright."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: pip install .[test]")
    chromium = Path("/usr/bin/chromium")
    if not chromium.is_file():
        pytest.skip("chromium is not there (Debian: apt-get install chromium)")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(chromium), args=["--no-sandbox"])
        yield browser
        browser.close()
