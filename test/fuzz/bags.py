"""Target ``bags``: damaged sessions through scan, info, replay and recovery.

A case is a file or folder made of the same messages. Silent is what is read as samples that are not those, from a file whose
messages are said to be under a checksum; what is saved without a word on what is lacking; what is invented; and anything of a
file outside the session.
"""

from __future__ import annotations

import struct
import tempfile
import zlib
from collections import Counter
from functools import cache
from pathlib import Path

import lz4.frame
import numpy as np
import zstandard
from default_boom import posture_angles, strokes_of_posture
from mcap.opcode import Opcode
from numpy.random import Generator
from recordings import Session, recover, scan, write_session

from boom_twin import BagError, BoomTwinError, load_scene, replay
from boom_twin.bag.session_file import as_bag_error

from .mcap_files import PREFIX, VARIANTS, joined, records, rewrite
from .mutate import DAMAGES, damaged, flipped, pick, rearranged
from .odd_yaml import odd
from .verdict import Kind, Verdict, printed, worst

FILE, METADATA, SESSION_YAML = "session_0.mcap", "metadata.yaml", "session.yaml"
ROWS = 16
SECRET = b"a secret outside of the session"
REPLAYED = 8
"""One in so many of the cases that can be read is replayed."""
HUGE = (0, 1, 2**31, 2**32 - 1, 2**40, 2**63, 2**64 - 1)
Message = tuple[str, int, bytes]


@cache
def _home() -> tempfile.TemporaryDirectory:
    """Where the whole sessions are; kept as long as the process."""
    return tempfile.TemporaryDirectory(prefix="boom_twin_bags_")


@cache
def base() -> Path:
    """The whole session as the package writes it, a folder."""
    random, scene = np.random.default_rng(5), load_scene()
    strokes = strokes_of_posture(scene, "arch") + random.normal(0.0, 2e-5, (ROWS, 4))
    imu = random.normal((0.0, 9.81), 0.05, (ROWS, 2))
    stamps = 1_700_000_000_000_000_000 + np.arange(ROWS) * 5_000_000
    path = Path(_home().name) / "base"
    angles = np.tile(posture_angles(scene, "arch"), (ROWS, 1))
    write_session(path, stamps, strokes, angles, imu, {"origin": "synthetic, a test"})
    (path / SESSION_YAML).write_text("origin: synthetic, a test\nnote: null\nscene: ''\nparameters: ''\nmapping: ''\n")
    return path


@cache
def _variant(name: str) -> bytes:
    """The one file of the whole session, written in another way."""
    return rewrite(base() / FILE, Path(_home().name) / f"{name}.mcap", **VARIANTS[name]).read_bytes()


@cache
def _truth() -> Counter[Message]:
    return Counter(_messages(scan(base())))


def _messages(session: Session) -> list[Message]:
    """Topic, log time and bytes of all messages."""
    found = []
    for file in session.files:
        with as_bag_error(file.path):
            for _, _, block in file.parts(set(), file.log_clock):
                for row, (channel, time) in enumerate(zip(block.sources.tolist(), block.log_times.tolist(), strict=True)):
                    found.append((file.channels[channel].topic, time, block.data(row)))
    return found


@cache
def begin() -> None:
    """Make the whole sessions, and replay one."""
    for name in VARIANTS:
        _variant(name)
    _truth()
    _base_results()


# -- making ---------------------------------------------------------------------------------------------------------------


def make(random: Generator, path: Path) -> Path:
    """Write a damaged session, a folder with or without metadata, or a bare file."""
    if random.random() < 0.5:
        path.mkdir()
        for name in (FILE, METADATA, SESSION_YAML):
            (path / name).write_bytes((base() / name).read_bytes())
        how = random.random()
        if how < 0.3:
            _edit(random, path / METADATA)
        elif how < 0.4:
            _edit(random, path / SESSION_YAML)
        elif how < 0.5:
            _link(random, path)
        else:
            (path / FILE).write_bytes(_broken(random, (path / FILE).read_bytes()))
            if random.random() < 0.5:
                (path / METADATA).unlink()
        return path
    file = path.with_suffix(".mcap")
    file.write_bytes(_broken(random, _variant(str(pick(random, list(VARIANTS))))))
    return file


def _edit(random: Generator, path: Path) -> None:
    text = path.read_text()
    if random.random() < 0.3:
        path.write_bytes(damaged(random, text.encode()))
        return
    for _ in range(int(random.integers(1, 4))):
        text = odd(random, text) if random.random() < 0.7 else rearranged(random, text)
    path.write_bytes(text.encode("utf-8", "surrogatepass"))


def _link(random: Generator, path: Path) -> None:
    """One of the files is a link to something else."""
    secret = path.with_name("secret")
    secret.write_bytes(SECRET)
    file = path / str(pick(random, (FILE, METADATA, SESSION_YAML)))
    file.unlink()
    file.symlink_to(pick(random, (secret, "/dev/zero", "/etc/passwd", file.name, ".", "nothing")))


def _broken(random: Generator, data: bytes) -> bytes:
    return pick(random, (flipped, damaged, pick(random, DAMAGES), _rearranged, _relabelled, _bomb, _unvouched))(random, data)


def _rearranged(random: Generator, data: bytes) -> bytes:
    """Records are elsewhere, missing, or there twice."""
    found = records(data)
    for _ in range(int(random.integers(1, 3))):
        one, other = (int(random.integers(len(found))) for _ in range(2))
        how = random.integers(4)
        if how == 0:
            found[one], found[other] = found[other], found[one]
        elif how == 1:
            found.insert(other, found[one])
        elif how == 2 and len(found) > 1:
            del found[one]
        else:
            found = found[: max(1, one)]
    return joined(found)


def _relabelled(random: Generator, data: bytes) -> bytes:
    """A length, a count, a time or an opcode is absurd."""
    found = records(data)
    place = int(random.integers(len(found)))
    opcode, body = found[place]
    if random.random() < 0.2:
        found[place] = (int(random.integers(256)), body)
        return joined(found)
    if random.random() < 0.3:
        start = data.index(PREFIX.pack(opcode, len(body)))
        return data[:start] + PREFIX.pack(opcode, int(pick(random, HUGE))) + data[start + PREFIX.size :]
    size = int(pick(random, (2, 4, 8)))
    at = int(random.integers(max(1, len(body) - size)))
    number = (int(pick(random, HUGE)) % 256**size).to_bytes(size, "little")
    found[place] = (opcode, body[:at] + number + body[at + size :])
    return joined(found)


def _bomb(random: Generator, data: bytes) -> bytes:
    """A chunk that unpacks to far more than it should, in front of the others."""
    size = int(pick(random, (60 * 2**20, 70 * 2**20, 2**28)))
    name, packed = pick(random, ((b"zstd", _packed_zstd(size)), (b"lz4", _packed_lz4(size))))
    stated = int(pick(random, (size, 100, 60 * 2**20, *HUGE)))
    head = struct.pack("<QQQII", 0, 0, stated, int(pick(random, (0, 1))), len(name)) + name + struct.pack("<Q", len(packed))
    found = records(data)
    found[1:1] = [(int(Opcode.CHUNK), head + packed)] * int(pick(random, (1, 1, 20)))
    return joined(found)


@cache
def _packed_zstd(size: int) -> bytes:
    return zstandard.ZstdCompressor().compress(bytes(size))


@cache
def _packed_lz4(size: int) -> bytes:
    packed: bytes = lz4.frame.compress(bytes(size))
    return packed


def _unvouched(random: Generator, data: bytes) -> bytes:
    """A chunk has no checksum, and a byte of it is another; all else vouches for it."""
    found = records(data)
    chunks = [i for i, (opcode, _) in enumerate(found) if opcode == Opcode.CHUNK]
    if not chunks:
        return damaged(random, data)
    place = int(pick(random, chunks))
    body = bytearray(found[place][1])
    body[24:28] = bytes(4)
    body[int(random.integers(60, len(body)))] ^= 1 << int(random.integers(8))
    found[place] = (int(Opcode.CHUNK), bytes(body))
    return joined(found)


# -- judging --------------------------------------------------------------------------------------------------------------


def judge(path: Path) -> Verdict:
    """Read, tell, replay and save."""
    with tempfile.TemporaryDirectory() as place:
        code, words = printed("info", str(path))
        told = _refused(words)
        return worst(
            _read(path),
            told if code or told.is_finding else Verdict(Kind.EQUAL),
            _replayed(path),
            _recovered(path, Path(place)),
        )


def _read(path: Path) -> Verdict:
    try:
        session = scan(path)
        found = Counter(_messages(session))
    except BagError as error:
        return _refused(str(error))
    if found == _truth():
        return Verdict(Kind.EQUAL)
    if not session.checked:
        return Verdict(Kind.TOLD, "its messages are said to be under no checksum")
    return Verdict(Kind.SILENT, f"read {found.total()} messages, {(found & _truth()).total()} of them of the session")


def _replayed(path: Path) -> Verdict:
    """A replay of the same samples gives the same messages, whatever stands in the notes."""
    if _read(path).kind is not Kind.EQUAL or zlib.crc32(path.name.encode()) % REPLAYED:
        return Verdict(Kind.EQUAL)
    try:
        found = _results(path)
    except BoomTwinError as error:
        return _refused(str(error))
    return Verdict(Kind.EQUAL) if found == _base_results() else Verdict(Kind.SILENT, "the same samples replay to other results")


@cache
def _base_results() -> Counter[Message]:
    return _results(base())


def _results(path: Path) -> Counter[Message]:
    """The messages that a replay of this session writes."""
    with tempfile.TemporaryDirectory() as place:
        out = Path(place) / "out"
        replay(path, load_scene(), out)
        return Counter(_messages(scan(out / "bag")))


def _recovered(path: Path, place: Path) -> Verdict:
    """A rescue tells what is lacking, invents nothing, and takes nothing from outside."""
    out = place / "saved"
    try:
        outcome = recover(path, out)
    except BagError as error:
        return _refused(str(error))
    for file in out.iterdir():
        if SECRET in file.read_bytes():
            return Verdict(Kind.SILENT, f"{file.name} of the rescue holds what stands outside of the session")
    found = Counter(_messages(scan(out)))
    if found == _truth():
        return Verdict(Kind.EQUAL)
    invented, unvouched = sum(found[each] for each in found if each not in _truth()), outcome.unvouched.total()
    if invented > unvouched:
        words = f"{invented} messages of the rescue are not of the session, {unvouched} said to be unvouched for"
        return Verdict(Kind.SILENT, words)
    lacking = (_truth() - found).total()
    is_told = outcome.fault_count or outcome.nameless or outcome.lost is None or any(outcome.lost.values()) or unvouched
    if not is_told:
        return Verdict(Kind.SILENT, f"{lacking} messages lack in the rescue, or some are there twice, without a word")
    return Verdict(Kind.TOLD, f"{lacking} lacking, {outcome.fault_count} faults told, {unvouched} unvouched for")


def _refused(words: str) -> Verdict:
    """A refusal, if it tells nothing from outside of the session."""
    return Verdict(Kind.SILENT if SECRET.decode() in words else Kind.REFUSED, words)
