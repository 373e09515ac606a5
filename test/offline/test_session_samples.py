"""What a replay reads of sessions of every kind against the same messages taken one by one."""

from __future__ import annotations

from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzz.mcap_files import write
from mcap.writer import CompressionType, IndexType
from recordings import load_mapping, scan
from ros_messages import (
    TYPES,
    Output,
    SampleDecoder,
    Topics,
    decode,
    decode_changes,
    encode_changes,
    jazzy,
    load_topics,
    stamp_of,
)

from boom_twin import BagError, Sample, Stream
from boom_twin.bag.session_file import REMEDY
from boom_twin.offline.session_samples import Changes, SessionSamples
from boom_twin.twin.blocks import samples_in
from boom_twin.types import Change

JOINTS = 3
START = 1_700_000_000_000_000_000
STEP = 5_000_000
MESSAGES = jazzy().types
CHANGES = load_topics().outputs[Output.CHANGES].absolute
MAPPING = """
sensors:
  cylinder_1: {zero: 3.25, scale: 1.01, unit: mm}
  cylinder_3: {name: boom, sign: -1}
  joint_2: {unit: deg, zero: -0.5, sign: -1}
  tip_imu_x: {name: z, sign: -1, unit: g}
  tip_imu_z: {name: x}
"""
SHARED = "inputs: {cylinder_strokes: {name: /rig}, joint_angles: {name: /rig}}\n"
FRAMED = "inputs: {tip_imu: {frame_id: crane}}\n"
FILES: list[dict[str, Any]] = [
    {"compression": CompressionType.NONE, "chunk_size": 300},
    {"compression": CompressionType.LZ4, "chunk_size": 20_000},
    {"compression": CompressionType.ZSTD, "chunk_size": 5_000},
    {"compression": CompressionType.ZSTD, "chunk_size": 2**20},
    {"index_types": IndexType.NONE, "chunk_size": 4_000},
    {"use_chunking": False},
]
Entry = tuple[int, str, bytes]  # log time, topic, encoded message


class Rig:
    """Makes the messages of a rig: mostly alike for a while, some odd; of a calm rig all whole and in order."""

    def __init__(self, random: np.random.Generator, odd: float, is_calm: bool = False) -> None:
        self._random, self._odd, self._is_calm = random, odd, is_calm

    def chance(self, probability: float) -> bool:
        return bool(self._random.random() < probability)

    def any_of(self, choices: list[Any]) -> Any:
        return choices[self._random.integers(len(choices))]

    def names(self) -> list[str]:
        if self._is_calm:
            return ["boom", *self._random.permutation([f"{kind}_{i}" for kind in ("joint", "cylinder") for i in (1, 2, 3)])]
        cylinders = self.any_of([["cylinder_1", "cylinder_2", "cylinder_3"], ["boom", "cylinder_2"], ["cylinder_3"]])
        joints = self.any_of([["joint_1", "joint_2", "joint_3"], ["joint_3", "joint_1"]])
        names = self.any_of([cylinders, cylinders, joints, joints, [*joints, "valve", *cylinders], ["valve"], [], ["joint_4"]])
        return list(self._random.permutation(names)) if self.chance(0.3) else names

    def layout(self) -> dict[str, Any]:
        """What a sensor keeps for a while."""
        names = self.names()
        count = len(names) if self._is_calm or self.chance(0.8) else int(self._random.integers(0, 5))
        frame = self.any_of(["", "base_link", "tip", "a longer frame of reference"])
        return {"names": names, "count": count, "frame": frame, "little": self.chance(0.9), "effort": self.any_of([0, 0, 2])}

    def number(self) -> float:
        if self.chance(self._odd):
            return float(self.any_of([np.nan, np.inf, -np.inf, 1e6, 1.0001e6, -1e300, 0.0, -0.0, 5e-324]))
        return float(self._random.normal())

    def stamp(self, log: int) -> tuple[int, int]:
        odd = [(0, 0), (-1, 5), (2**31 - 1, 4 * 10**9), (5, 2**32 - 1)]
        return self.any_of(odd) if self.chance(self._odd) else divmod(log - 1234, 10**9)

    def message(self, kind: str, log: int, layout: dict[str, Any]) -> bytes:
        stamp = MESSAGES["builtin_interfaces/msg/Time"](*self.stamp(log))
        header = MESSAGES["std_msgs/msg/Header"](stamp, layout["frame"])
        if kind == TYPES[Stream.IMU]:
            vector, covariance = MESSAGES["geometry_msgs/msg/Vector3"], np.zeros(9)
            force = np.array([-1.0 if self.chance(self._odd) else 0.01, *covariance[1:]])
            turned = MESSAGES["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
            parts = [turned, covariance, vector(0.0, 0.0, 0.0), covariance, vector(*(self.number() for _ in "xyz")), force]
        else:
            numbers = [np.array([self.number() for _ in range(count)]) for count in (layout["count"], 0, layout["effort"])]
            parts = [layout["names"], *numbers]
        data = bytes(jazzy().serialize_cdr(MESSAGES[kind](header, *parts), kind, little_endian=layout["little"]))
        if self.chance(self._odd):
            data += self._random.bytes(int(self._random.integers(0, 13)))
        return data

    def session(self, topics: Topics, files: int, rows: int) -> list[list[Entry]]:
        """The messages of every file in its order, which is not quite that of the log times."""
        inputs = {topic.absolute: topic.type for topic in topics.inputs.values()}
        layouts = {name: self.layout() for name in inputs}
        found: list[list[Entry]] = [[] for _ in range(files)]
        overlap = self.any_of([0, 0, rows // 10, rows])
        for row in range(rows):
            for name, kind in inputs.items():
                log = START + STEP * row + int(self._random.integers(-1, 2)) * self.any_of([0, 0, STEP * (not self._is_calm)])
                if self.chance(0.02):
                    layouts[name] = self.layout()
                place = row + self._random.integers(0, overlap + 1)
                found[min(int(place * files // rows), files - 1)].append((log, name, self.message(kind, log, layouts[name])))
                if self.chance(0.1):
                    found[-1].append((log, "/foreign", self._random.bytes(20)))
            if self.chance(0.01):
                change = Change(log - 1234, False, {"payload": float(row % 50)}, {})
                found[0].append((log, CHANGES, encode_changes(change)))
        return found


def write_files(folder: Path, files: list[list[Entry]], options: list[dict[str, Any]], topics: Topics) -> None:
    """A session as bare files, with definitions left empty."""
    kinds = {topic.absolute: topic.type for topic in topics.inputs.values()} | {CHANGES: TYPES[Output.CHANGES]}
    folder.mkdir()
    for number, (entries, how) in enumerate(zip(files, options, strict=True)):
        rows = ((name, kinds.get(name, "other_msgs/msg/Other"), "cdr", log, data) for log, name, data in entries)
        write(folder / f"session_{number}.mcap", rows, **how)


Found = list[tuple[Any, ...] | Change]


class Expected:
    """What taking one message after the other gives: samples and changes, and between changes how many messages had none."""

    def __init__(self, folder: Path, files: list[list[Entry]], topics: Topics) -> None:
        self.found: Found = []
        self.without = [0]
        self.error = ""
        self._decoder, self._heard = (
            SampleDecoder(JOINTS, topics),
            {f"/{k.lstrip('/')}": v for k, v in topics.streams_by_topic.items()},
        )
        sorted_files = [sorted(entries, key=itemgetter(0)) for entries in files]
        entries = [(*entry, number) for number, file in enumerate(sorted_files) for entry in file]
        entries.sort(key=itemgetter(0))
        told = [(log, decode(data, TYPES[Output.CHANGES])) for log, name, data, _ in entries if name == CHANGES]
        self._changes = Changes((log, decode_changes(msg)) for log, msg in told)
        for log, name, data, number in entries:
            if name in self._heard and not self.error:
                self._take(log, name, data, folder / f"session_{number}.mcap")
        self.found += map(plain, self._decoder.assembler.rest() if not self.error else ())
        self.oddities = dict(self._decoder.oddities)

    def _take(self, log: int, name: str, data: bytes, file: Path) -> None:
        streams = self._heard[name]
        try:
            msg = decode(data, TYPES[streams[0]])
        except Exception as error:
            self.error = f"{file}: topic {name} at log time {log} ns: {error} {REMEDY}"
            return
        stamp = stamp_of(msg)
        for change in self._changes.due(log, stamp) if Stream.STROKES in streams else ():
            self.found.append(change)
            self.without.append(0)
        before = self._decoder.refused
        self.found += map(plain, self._decoder.samples(streams, stamp, msg))
        self.without[-1] += self._decoder.refused - before


def plain(sample: Sample) -> tuple[Any, ...]:
    return sample.stream, sample.stamp, sample.values.tobytes()


def compare(folder: Path, topics: Topics, expected: Expected) -> None:
    """That the session in `folder` is read as expected."""
    found: Found = []
    without, error = [0], ""
    try:
        samples = SessionSamples(scan(folder), topics, JOINTS)
        for item in samples:
            if item is None:
                without[-1] += 1
            elif isinstance(item, Change):
                found.append(item)
                without.append(0)
            else:
                found += map(plain, samples_in(item, JOINTS))
    except BagError as told:
        error = str(told)
    assert error == expected.error
    if not error:
        assert found == expected.found
        assert (without, dict(samples.oddities)) == (expected.without, expected.oddities)
    else:
        assert found == expected.found[: len(found)]


def mapped(folder: Path, shared: bool, text: str) -> Topics:
    (folder / "mapping.yaml").write_text((SHARED if shared else "") + text)
    return load_mapping(folder / "mapping.yaml", JOINTS)


@pytest.mark.parametrize("seed", range(18))
def test_a_session_of_any_layouts_is_read_as_one_message_after_the_other(tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)
    topics = mapped(tmp_path, shared=seed % 3 == 0, text=FRAMED * (seed in (13, 14)) + MAPPING * (seed % 2))
    is_calm = seed >= 12
    rig = Rig(random, 0.001 if is_calm else float(random.choice([0.0, 0.01, 0.2])), is_calm)
    count = int(random.integers(1, 4))
    files = rig.session(topics, count, rows=int(random.choice([30, 400])))
    write_files(tmp_path / "bag", files, [FILES[random.integers(len(FILES))] for _ in range(count)], topics)
    expected = Expected(tmp_path / "bag", files, topics)
    assert any(isinstance(each, tuple) for each in expected.found) and not expected.error
    compare(tmp_path / "bag", topics, expected)


@pytest.mark.parametrize("seed", range(6))
def test_a_message_that_cannot_be_decoded_is_told_as_the_first_one(tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)
    topics = mapped(tmp_path, shared=seed % 3 == 0, text="")
    files = Rig(random, odd=0.01).session(topics, 2, rows=200)
    for _ in range(2):
        entries = files[random.integers(2)]
        place = int(random.integers(len(entries)))
        log, name, data = entries[place]
        if name in (CHANGES, "/foreign"):
            continue
        bad = [data[: random.integers(len(data))], data + bytes(20), data[:16] + b"\xff" * 4 + data[20:], b"\7\7" + data[2:]]
        entries[place] = (log, name, bad[random.integers(len(bad))])
    write_files(tmp_path / "bag", files, [FILES[random.integers(len(FILES))] for _ in range(2)], topics)
    expected = Expected(tmp_path / "bag", files, topics)
    compare(tmp_path / "bag", topics, expected)
