"""Where the time of a replay goes, in one process: ``python test/bench/replay_stages.py [SESSION] [--runs 8]``.

For a machine that does other things too: CPU time, and as every run makes the same calls in the same order, of each call the
least of all runs. What is cached less on a busy machine remains in it. The digest is of all that was told: equal before and
after a change that is to be of speed alone.
"""

from __future__ import annotations

import argparse
import gc
import hashlib
import os
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as in a replay

import numpy as np
from drive_twin import ARCH_DRIVES, drive_twin

from boom_twin.bag.reader import scan
from boom_twin.bag.session_model import baseline_of, mapping_of, scene_of, settings_of
from boom_twin.bag.writer import RESULT_CHUNK_SIZE, SessionWriter
from boom_twin.estimation.deviation_modes import DeviationModes
from boom_twin.health.monitor import HealthMonitor
from boom_twin.health.residual_monitor import ResidualMonitor
from boom_twin.messages.report_encoder import ReportEncoder
from boom_twin.messages.topic_table import Output
from boom_twin.offline.reader_process import items_of
from boom_twin.offline.writer_process import pack
from boom_twin.twin.block_update import BlockUpdate
from boom_twin.twin.blocks import SampleBlock
from boom_twin.twin.driver import drive_blocks
from boom_twin.twin.expected_readings import Deviations
from boom_twin.twin.twin import Twin
from boom_twin.types import Change, Report

STAGES = {
    "all of the twin": (Twin, "update_block"),
    "health, all of it": (BlockUpdate, "judge"),
    "of that its blocks": (HealthMonitor, "_judge"),
    "of these what residuals mean": (ResidualMonitor, "take"),
    "expected deviations": (Deviations, "refresh"),
    "modes of the estimate": (DeviationModes, "refresh"),
    "reports of rows": (BlockUpdate, "reports"),
}

Durations = dict[str, list[float]]


def timed(task: Callable[..., Any], durations: list[float]) -> Callable[..., Any]:
    """As `task`, adding how long every call takes."""

    def call(*arguments: Any, **named: Any) -> Any:
        began = time.thread_time()
        try:
            return task(*arguments, **named)
        finally:
            durations.append(time.thread_time() - began)

    return call


def run(session: Path, durations: Durations) -> str:
    """One replay; gives the digest."""
    found, scene = scan(session), scene_of(session, None).scene
    joints, settings, usual = len(scene.joints), settings_of(session).settings, baseline_of(session, None)
    topics = mapping_of(session, None, joints, "").topics
    wanted = [name for name in topics.heard if (topic := found.find(name)) is not None and topic.count]
    read = iter(items_of(session, topics, wanted, joints))
    following, items = timed(lambda: next(read, None), durations["reading, decoding"]), list[SampleBlock | Change]()
    while (item := following()) is not None:
        items += [item] if isinstance(item, SampleBlock | Change) else []
    twin, digest = drive_twin(scene, settings, topics.mounts(joints), usual.baseline), hashlib.sha256()
    twin.warm_up()
    for name in STAGES:
        durations[name].clear()
    outputs = {key: topic for key, topic in topics.outputs.items() if key is not Output.DIAGNOSTICS}
    encoder = ReportEncoder(scene, settings, topics.frame)
    with tempfile.TemporaryDirectory() as place:
        with SessionWriter(Path(place) / "bag", outputs, {}, chunk_size=RESULT_CHUNK_SIZE) as writer:
            encode = timed(encoder.fill_block, durations["encoding"])
            write = timed(writer.write_block, durations["writing"])
            for step in drive_blocks(twin, items):
                for each in step[1] if step is not None else ():
                    for part in pack(each.all, joints) if isinstance(each, Report) else (each,):
                        if not isinstance(part, Report):
                            write(encode(part))
                            digest.update(repr(list(part.health.items())).encode())
        digest.update(b"".join(file.read_bytes() for file in sorted((Path(place) / "bag").glob("*.mcap"))))
    return digest.hexdigest()[:16]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("session", type=Path, nargs="?", default=ARCH_DRIVES)
    parser.add_argument("--runs", type=int, default=8)
    args = parser.parse_args()
    durations: Durations = defaultdict(list)
    for name, (kind, method) in STAGES.items():
        setattr(kind, method, timed(getattr(kind, method), durations[name]))
    runs, digests = list[Durations](), set[str]()
    gc.disable()
    for _ in range(args.runs):
        for each in durations.values():
            each.clear()
        digests.add(run(args.session, durations))
        runs.append({name: list(each) for name, each in durations.items()})
    print("| stage | s | calls |\n|---|---|---|")
    for name in durations:
        least = np.min([each[name] for each in runs], axis=0)
        print(f"| {name} | {least.sum():.3f} | {len(least)} |")
    print("digest", *digests)


if __name__ == "__main__":
    main()
