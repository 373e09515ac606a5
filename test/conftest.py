"""Common to all tests: makes this folder importable, for the witnesses in ``oracle``; the ROS domain of the run."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from boom_twin.ros.isolation import Isolation

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def isolation() -> Iterator[Isolation]:
    """A ROS domain that only this test run uses, closed to others.

    All that starts a ROS node in this process needs it: the middleware takes a process into a partition when its first node
    starts, and never again.
    """
    from boom_twin.ros.isolation import isolated

    with isolated() as claimed:
        yield claimed
