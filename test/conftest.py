"""Common to all tests: makes this folder importable, for the witnesses in ``oracle``; who runs what; the ROS domain."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from zlib import crc32

import pytest

if TYPE_CHECKING:
    from boom_twin.ros.isolation import Isolation

HERE = Path(__file__).parent
TOGETHER = ("calibrate", "monitor", "report")
"""Folders whose costly fixtures are made once for all their files."""

sys.path.insert(0, str(HERE))


@pytest.hookimpl(tryfirst=True)  # xdist reads the groups in the same hook
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep what shares fixtures in one process where several run the tests: a file, or one of the folders `TOGETHER`.

    These folders, which take longest, come first; files come mixed, so that not all wait for a ROS node at a time.
    """
    assert all((HERE / folder).is_dir() for folder in TOGETHER)
    for item in items:
        item.add_marker(pytest.mark.xdist_group(_group(item)))
    if "PYTEST_XDIST_WORKER" in os.environ:
        items.sort(key=lambda item: (_group(item) not in TOGETHER, crc32(_group(item).encode())))


def _group(item: pytest.Item) -> str:
    folder = item.path.parent.name
    return folder if folder in TOGETHER else str(item.path.relative_to(HERE))


@pytest.fixture(scope="session")
def isolation() -> Iterator[Isolation]:
    """A ROS domain that only this process of the test run uses, closed to others.

    All that starts a ROS node in this process needs it: the middleware takes a process into a partition when its first node
    starts, and never again.
    """
    from boom_twin.ros.isolation import isolated

    with isolated() as claimed:
        yield claimed
