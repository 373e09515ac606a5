"""A scene for the tests of the virtual rig."""

from __future__ import annotations

from typing import Any

import pytest
from oracle import booms


@pytest.fixture
def one_rigid() -> dict[str, Any]:
    """One rigid section of 40 kg on a massless, undamped cylinder with an oil spring."""
    return booms.one_rigid(k=2.0e6)
