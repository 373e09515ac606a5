"""The thread that writes a recording: disks that fill up or stall, and kills."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from threading import Event

import pytest
from recordings import read, read_metadata, recover, scan
from ros_messages import encoded, joint_state, load_topics
from rosbags.highlevel import AnyReader

from boom_twin import BagError, Stream
from boom_twin.bag import async_writer as module
from boom_twin.bag.async_writer import Storage
from boom_twin.bag.writer import BagWriter, recorded

TOPIC = load_topics().inputs[Stream.STROKES]
STEP = 5_000_000


def message(number: int) -> bytes:
    return encoded(joint_state([], [0.1 * number], number * 10**9))


def numbers(path: Path) -> list[int]:
    """What `message` was given, in the order of the log times."""
    return [msg.header.stamp.sec for _, _, msg in read(scan(path), {TOPIC.name: TOPIC.type})]


def fill(storage: Storage, count: int) -> list[int]:
    key = storage.add(recorded(TOPIC))
    for number in range(count):
        storage.put(key, number * STEP, message(number), number * STEP, number)
    return storage.close()


def test_a_recording_is_whole(tmp_path: Path) -> None:
    assert fill(Storage(BagWriter(tmp_path / "bag", {"note": "n"}), pytest.fail), 500) == [500]
    metadata = read_metadata(tmp_path / "bag" / "metadata.yaml")
    assert [file["message_count"] for file in metadata.files] == [metadata.message_count] == [500]
    assert numbers(tmp_path / "bag") == list(range(500))
    with AnyReader([tmp_path / "bag"]) as reader:
        assert reader.message_count == sum(1 for _ in reader.messages()) == 500
    assert scan(tmp_path / "bag" / metadata.relative_file_paths[0]).notes == {"note": "n"}


def test_a_recording_without_its_end_is_noticed_and_recovered(tmp_path: Path) -> None:
    bag = BagWriter(tmp_path / "bag")
    (key,) = bag.add(recorded(TOPIC))
    bag.write(key, 1, message(1))
    bag.write(key, 2, message(2))
    bag.flush()
    bag.abandon()
    with pytest.raises(BagError, match=r"session_0\.mcap: incomplete: the end is missing.*recover"):
        scan(tmp_path / "bag")
    assert recover(tmp_path / "bag", tmp_path / "out").saved.total() == 2
    assert numbers(tmp_path / "out") == [1, 2]


FULL = """
import sys
from pathlib import Path
sys.path.insert(0, {here!r})
from bag.test_storage import BagError, BagWriter, Storage, message, recorded, TOPIC
import resource, time
storage = Storage(BagWriter(Path({bag!r})), print)
key = storage.add(recorded(TOPIC))
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
try:
    for number in range(100_000):
        storage.put(key, number, message(number), number, number)
        if number % 100 == 0:
            storage.check()
            time.sleep(0.01)
except BagError as error:
    print(error, flush=True)
    sys.exit(1)
"""


@pytest.mark.system
def test_a_disk_that_fills_up(tmp_path: Path) -> None:
    """The limit on the size of a file stands for the disk's."""
    bag = tmp_path / "bag"
    program = FULL.format(here=str(Path(__file__).parents[1]), bag=str(bag))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    assert done.returncode == 1 and done.stderr == ""
    assert "session_0.mcap: cannot be written (File too large). Make room" in done.stdout and done.stdout.count("\n") == 1
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] == resource.RLIM_INFINITY
    outcome = recover(bag, tmp_path / "out")
    assert numbers(tmp_path / "out") == list(range(outcome.saved.total())) and outcome.saved.total() > 500


def until(condition: Callable[[], bool]) -> None:
    """Wait for an event of another thread; the limit is for a machine with other work."""
    end = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_disk_that_stalls_holds_up_no_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages leave the process meanwhile: it may be killed."""
    told: list[str] = []
    answers, real = Event(), os.fsync
    monkeypatch.setattr(module, "STALL", 0.3)
    monkeypatch.setattr(module, "FLUSH", 0.05)
    monkeypatch.setattr("os.fsync", lambda file: answers.wait(60.0) and real(file))
    flushed, flush = list[int](), BagWriter.flush
    monkeypatch.setattr(BagWriter, "flush", lambda bag: (flushed.append(bag.counts.total()), flush(bag))[1])
    storage = Storage(BagWriter(tmp_path / "bag"), told.append)
    key = storage.add(recorded(TOPIC))
    for number in range(300):
        storage.put(key, number, message(number), number, number)

    def has_told(count: int) -> bool:
        storage.check()
        return len(told) == count

    until(lambda: has_told(1) and flushed.count(300) > 1)  # the first of them has ended
    assert storage.state().lag > 0.3
    shutil.copytree(tmp_path / "bag", tmp_path / "killed")
    answers.set()
    until(lambda: has_told(2))
    assert storage.close() == [300]
    assert "has not answered for" in told[0] and "answers again; nothing was lost" in told[1]
    assert recover(tmp_path / "killed", tmp_path / "out").saved.total() == 300


def test_a_disk_that_never_answers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers, is_stuck, flush = Event(), Event(), BagWriter.flush

    def stuck(bag: BagWriter) -> int:
        is_stuck.set()
        answers.wait(60.0)
        return flush(bag)

    monkeypatch.setattr(module, "MOST_WAITING", 10_000)
    monkeypatch.setattr(module, "FLUSH", 0.01)
    monkeypatch.setattr(module, "PATIENCE", 0.2)
    monkeypatch.setattr(BagWriter, "flush", stuck)
    storage = Storage(BagWriter(tmp_path / "bag"), lambda text: None)
    key = storage.add(recorded(TOPIC))
    assert is_stuck.wait(60.0)
    with pytest.raises(BagError, match="does not keep up: 0 MiB of messages wait"):
        for number in range(1000):
            storage.put(key, number, message(number), number, number)
            storage.check()
    with pytest.raises(BagError, match="does not keep up: it has not answered"):
        storage.close()
    monkeypatch.setattr(module, "PATIENCE", 60.0)
    answers.set()
    storage.close()


KILLED = """
import sys, time
from pathlib import Path
sys.path.insert(0, {here!r})
from bag.test_storage import BagWriter, Storage, message, recorded, TOPIC
storage = Storage(BagWriter(Path({bag!r})), print)
key = storage.add(recorded(TOPIC))
for number in range(10**6):
    storage.put(key, time.time_ns(), message(number), 0, number)
    print(number, storage.state().written, flush=True)
    time.sleep(0.005)
"""


@pytest.mark.parametrize("more", [60, *(pytest.param(40 * k, marks=pytest.mark.slow) for k in range(5))])
@pytest.mark.system
def test_a_kill_costs_little(tmp_path: Path, more: int) -> None:
    """A recording is killed so many messages after its second flush, which has all that was put before the first had ended."""
    bag = tmp_path / "bag"
    program = KILLED.format(here=str(Path(__file__).parents[1]), bag=str(bag))
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    flushed, written = list[int](), 0
    while len(flushed) < 2:
        last, told = map(int, child.stdout.readline().split())
        flushed += [last] if told > written else []
        written = told
    for _ in range(more):
        last = int(child.stdout.readline().split()[0])
    child.send_signal(signal.SIGKILL)
    last += child.stdout.read().count("\n")
    child.wait()
    outcome = recover(bag, tmp_path / "out")
    saved = numbers(tmp_path / "out")
    assert saved == list(range(len(saved))) and flushed[0] <= outcome.saved.total() == len(saved) <= last + 2
    assert outcome.lost is None or not any(outcome.lost.values())
