"""A session with faults in it, and what a replay says of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drive_twin import ARCH_DRIVES, note_drives
from made_once import MadeOnce

from boom_twin.bag.reader import read, scan
from boom_twin.bag.session_files import write_session
from boom_twin.config.settings import Settings
from boom_twin.messages.sample_decoder import SampleDecoder, stamp_of
from boom_twin.messages.topic_table import load_topics
from boom_twin.monitor.data.bag_feed import BagFeed, bag_feed
from boom_twin.monitor.data.feed import Feed
from boom_twin.offline.replay import replay
from boom_twin.scene import load_scene
from boom_twin.types import Stream

SECONDS, WRONG_FROM, GAP = 40.0, 15.0, (30.0, 30.6)
OFFSET = 0.02  # rad, by which joint 3's encoder is wrong from WRONG_FROM on


@pytest.fixture(scope="session")
def faulty(made_once: MadeOnce, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bundled session's first 40 s; an encoder jumps at 15 s, everything is silent from 30 to 30.6 s."""

    def jump(time: Any, joints: Any) -> None:
        joints[time >= WRONG_FROM, 2] += OFFSET

    to = tmp_path_factory.mktemp("faulty") / "faulty_session"
    return made_once.folder("faulty_session", lambda folder: spoilt(folder, jump), to)


def spoilt(path: Path, spoil: Callable[[Any, Any], None]) -> Path:
    """The bundled session's first 40 s with a gap, its joint angles spoilt by a function of times (s) and angles (rad)."""
    topics, decoder = load_topics().inputs, SampleDecoder(4)
    topics = {stream: topics[stream] for stream in (Stream.STROKES, Stream.ANGLES, Stream.IMU)}
    values: dict[Stream, list[Any]] = {stream: [] for stream in topics}
    names = {topic.absolute: stream for stream, topic in topics.items()}
    stamps = []
    for name, _, message in read(scan(ARCH_DRIVES), {topic.absolute: topic.type for topic in topics.values()}):
        sample = decoder.put(names[name], stamp_of(message), message)
        assert sample is not None
        values[names[name]].append(sample.values)
        if names[name] is Stream.STROKES:
            stamps.append(sample.stamp)
    stamps_ns = np.array(stamps)
    time = (stamps_ns - stamps_ns[0]) * 1e-9
    kept = (time < SECONDS) & ((time < GAP[0]) | (time > GAP[1]))
    joints = np.array(values[Stream.ANGLES])
    spoil(time, joints)
    arrays = (np.array(values[Stream.STROKES])[kept], joints[kept], np.array(values[Stream.IMU])[kept])
    write_session(path, stamps_ns[kept], *arrays, {"origin": "synthetic, encoder 3 made wrong"})
    note_drives(path)
    return path


@pytest.fixture(scope="session")
def feed(faulty: Path, made_once: MadeOnce) -> Feed:
    """That session through the twin."""
    return made_once.value("faulty_feed", lambda: read_all(bag_feed(faulty, load_scene(), Settings())))


def read_all(feed: BagFeed) -> BagFeed:
    """Once it is read."""
    feed.poll()
    while feed.is_reading:
        feed.poll()
    return feed


@pytest.fixture(scope="session")
def replayed(faulty: Path, made_once: MadeOnce, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its replay's folder, with ``summary.json`` and ``bag/``."""
    to = tmp_path_factory.mktemp("replayed")
    return made_once.folder("faulty_replayed", lambda folder: replay(faulty, load_scene(), folder), to)
