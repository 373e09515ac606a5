"""Kernels of health are compiled before the first sample, not while samples wait."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from drive_twin import PUMP_DRIVES

PUMP = Path(__file__).parents[2] / "bags" / "pump_session"

ONCE = [1] * 4
CODE = """
import sys
from pathlib import Path
from boom_twin.bag.reader import scan
from boom_twin.bag.session_model import mapping_of, scene_of, strokes_of
from boom_twin.health.sensor_findings import collect, examine
from boom_twin.offline.session_samples import SessionSamples
from boom_twin.twin.blocks import SampleBlock
from boom_twin.twin.twin import Twin
from boom_twin.twin.update import update, write_residual

path = Path(sys.argv[1])
scene, mapped = scene_of(path, None).scene, mapping_of(path, None, 4, "")
topics = mapped.topics
twin = Twin(scene, health=True, reads=strokes_of(path, mapped).reading)
twin.warm_up()
kernels = update, write_residual, collect, examine
ready = [len(kernel.dispatcher.signatures) for kernel in kernels]
session = scan(path)
told = 0
for item in SessionSamples(session, topics, 4):
    if isinstance(item, SampleBlock) and told < 3:
        told += len(twin.take(item).health)
print(ready, [len(kernel.dispatcher.signatures) for kernel in kernels], told)
"""


@pytest.mark.parametrize("session", [PUMP_DRIVES, PUMP], ids=["drives", "lengths"])
@pytest.mark.system
def test_nothing_is_compiled_while_a_session_runs(session):
    found = subprocess.run([sys.executable, "-c", CODE, str(session)], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == f"{ONCE} {ONCE} 3"
