"""Measure ``boom_twin batch``: its rate on one and two workers beside single replays, its behaviour under faults, Dask's share.

Run: .venv/bin/python test/bench/batch_sessions.py [--sessions 200] [--skip faults]. On an idle machine of two cores, 200
sessions of 60 s take about half an hour in all.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread

import psutil
import pyarrow.parquet as parquet
from distributed import Client, LocalCluster
from mcap.reader import make_reader
from mcap.writer import Writer

from boom_twin.bag.reader import read_blocks, scan
from boom_twin.batch.cluster import on_dask, rows_of
from boom_twin.batch.session_task import Row, SessionTask
from boom_twin.system.child_process import python_command

SESSION = Path(__file__).parents[2] / "bags" / "arch_session"
FIGURES = ("output_sha256", "samples", "joint_residual_rms_rad", "tip_acceleration_max_m_s2")
NANO = 1_000_000_000


def command(*arguments: object) -> list[str]:
    return python_command("boom_twin.cli.main", *map(str, arguments))


def write_beginning(path: Path, seconds: float) -> None:
    """The first seconds of the session as a file of its own."""
    with (SESSION / "session_0.mcap").open("rb") as source, path.open("wb") as stream:
        reader, writer, channels = make_reader(source), Writer(stream), dict[int, int]()
        writer.start("ros2", "bench")
        end = reader.get_summary().statistics.message_start_time + round(seconds * NANO)
        for schema, channel, message in reader.iter_messages(ending_before=end):
            if channel.id not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                names = channel.topic, channel.message_encoding, number, channel.metadata
                channels[channel.id] = writer.register_channel(*names)
            writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
        writer.finish()


def copies(folder: Path, count: int, seconds: float) -> None:
    """The same session so many times: links to one file."""
    folder.mkdir()
    beginning = folder.with_name("beginning.mcap")
    write_beginning(beginning, seconds)
    for number in range(count):
        (folder / f"s{number:04d}").mkdir()
        os.link(beginning, folder / f"s{number:04d}" / "session_0.mcap")
        os.link(SESSION / "session.yaml", folder / f"s{number:04d}" / "session.yaml")


def batch(sessions: Path, out: Path, workers: int, *more: object) -> float:
    """Seconds that a batch of all sessions in a folder takes."""
    began = time.perf_counter()
    subprocess.run(command("batch", sessions / "*", "--out", out, "--workers", workers, *more), check=False)
    return time.perf_counter() - began


def single(sessions: Path, out: Path, count: int) -> float:
    """Seconds that a replay of its own takes, without pictures, as the batch does it; the mean of `count`."""
    began = time.perf_counter()
    for number in range(count):
        done = command("replay", sessions / f"s{number:04d}", "--out", out / str(number), "--no-pictures")
        subprocess.run(done, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return (time.perf_counter() - began) / count


def write_hog(folder: Path, times: int) -> None:
    """A session without chunks, so without an index: all of it is held in memory to be put in order."""
    folder.mkdir()
    session = scan(SESSION)
    blocks = read_blocks(session, {topic.name: topic.type for topic in session.topics})
    file = session.files[0]
    with (folder / "session_0.mcap").open("wb") as stream:
        writer = Writer(stream, use_chunking=False)
        writer.start("ros2", "bench")
        channels = {}
        for channel in file.channels.values():
            schema = file.schemas[channel.schema_id]
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, number, channel.metadata)
        for k in range(times):
            for block in blocks:
                for row, (source, log) in enumerate(zip(block.sources.tolist(), block.log_times.tolist(), strict=True)):
                    at = log + k * 60_000_000_000
                    writer.add_message(channels[blocks.sources[source].topic], at, bytes(block.data(row)), at)
        writer.finish()


def kill_sessions(process: subprocess.Popen[bytes], every: float, ended: Event) -> None:
    """End the process of a session by force now and then, chosen at random."""
    choice = random.Random(1)
    while not ended.wait(every):
        with suppress(psutil.Error):
            if busy := psutil.Process(process.pid).children():
                choice.choice(busy).kill()


def faults(sessions: Path, out: Path, every: float) -> None:
    """Three broken sessions, one that is too slow, one too large, a session's process killed now and then, Ctrl-C."""
    whole = (SESSION / "session_0.mcap").read_bytes()
    for number, content in enumerate((whole[: len(whole) // 2], b"", whole[:5000] + bytes(200) + whole[5200:])):
        (sessions / f"x{number}").mkdir()
        (sessions / f"x{number}" / "session_0.mcap").write_bytes(content)
    write_hog(sessions / "x_memory", 20)
    (sessions / "x_time").mkdir()
    for number in range(60):  # an hour of messages, sixty with every stamp: takes far longer than it may
        os.link(SESSION / "session_0.mcap", sessions / "x_time" / f"session_{number}.mcap")
    arguments = ("batch", sessions / "*", "--out", out, "--workers", 2, "--memory", 700, "--timeout", 120)
    before: dict[str, int] = {}
    for is_stopped in (True, False):
        ended, process = Event(), subprocess.Popen(command(*arguments))
        killer = Thread(target=kill_sessions, args=(process, every, ended))
        killer.start()
        while process.poll() is None:
            if is_stopped and len(list((out / "rows").glob("*"))) > len(list(sessions.iterdir())) // 2:
                process.send_signal(signal.SIGINT)
                is_stopped = False
            time.sleep(0.1)
        ended.set()
        killer.join()
        rows = {path.name: path.stat().st_mtime_ns for path in (out / "rows").glob("*")}
        print(f"repeated after Ctrl-C: {sum(rows[name] != time for name, time in before.items())} of {len(before)}")
        before = rows
    table = parquet.read_table(out / "sessions.parquet").to_pylist()
    print(f"right {sum(row['status'] == 'ok' for row in table)}, failed {sum(row['status'] != 'ok' for row in table)}")
    for row in table:
        if row["status"] != "ok":
            print(" ", row["session"], row["attempts"], row["reason"])
    right = [row for row in table if row["status"] == "ok"]
    single(sessions, out.with_name("alone"), 1)
    alone = json.loads((out.with_name("alone") / "0" / "summary.json").read_text())
    print("equal to a single replay:", all(row[name] == alone[name] for row in right for name in FIGURES))
    print("processes lost, by the attempts of right rows:", sorted({row["attempts"] for row in right}))


def nothing(task: SessionTask) -> Row:
    """A task that does nothing."""
    return {"key": task.key, "status": "ok"}


def overhead(count: int) -> None:
    """What Dask takes for a task: client, scheduler and two worker threads together."""
    tasks = [SessionTask(str(k), "s", "o", "f", None, None, None, None, False, False, 1.0, 1, 0) for k in range(count)]
    with Client(LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None)) as client:
        began = time.perf_counter()
        assert sum(1 for _ in rows_of(on_dask(client, nothing), tasks)) == count
        print(f"Dask: {1e3 * (time.perf_counter() - began) / count:.2f} ms a task, {count} tasks, 2 workers")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=60.0, help="of each session")
    parser.add_argument("--kill-every", type=float, default=5.0)
    parser.add_argument("--tasks", type=int, default=5000, help="for Dask's share")
    parser.add_argument("--skip", nargs="*", default=[], choices=("overhead", "rate", "faults"))
    args = parser.parse_args()
    if "overhead" not in args.skip:
        overhead(args.tasks)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        copies(folder / "sessions", args.sessions, args.seconds)
        if "rate" not in args.skip:
            alone = single(folder / "sessions", folder / "single", min(args.sessions, 5))
            one, two = (batch(folder / "sessions", folder / f"out{n}", n) for n in (1, 2))
            each = [seconds / args.sessions for seconds in (one, two)]
            rates = f"single replay {alone:.2f} s; batch on 1 worker {each[0]:.2f} s, on 2 {each[1]:.2f} s"
            print(f"a session of {args.seconds:g} s: {rates}")
            print(f"2 workers: {one / two:.2f} times the rate of one, {alone / each[1]:.2f} times that of single replays")
        if "faults" not in args.skip:
            faults(folder / "sessions", folder / "faults", args.kill_every)


if __name__ == "__main__":
    main()
