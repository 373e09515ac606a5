"""Without Exudyn the rig says what to install."""

from __future__ import annotations

import subprocess
import sys

BLOCKED = """
import sys
sys.modules["exudyn"] = None
from boom_twin.errors import BoomTwinError
try:
    import boom_twin.validation.rig
except BoomTwinError as error:
    print(error)
"""


def test_missing_exudyn_is_one_clear_error():
    done = subprocess.run([sys.executable, "-c", BLOCKED], capture_output=True, text=True, check=True)
    assert 'pip install "boom_twin[peers]"' in done.stdout
