"""A stream whose stamps lag by a constant: the mapping tells by how much. Readings that arrive late are no worse for it."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from recordings import MessageWriter, SessionMetadata, read_both, scan
from ros_messages import TYPES, fill_header, jazzy, load_topics, stamp_of

from boom_twin import Stream, load_scene, replay
from boom_twin.types import SECOND

SESSION = Path(__file__).parents[2] / "bags" / "pump_session"
FIRST, ALL = 1500, 10**6
DELAYS = {Stream.ANGLES: 0.02, Stream.IMU: -0.0075, Stream.FORCES: 0.004}
MAPPING = "inputs:\n" + "".join(f"  {stream.value}: {{delay: {delay}}}\n" for stream, delay in DELAYS.items())


def written(
    path: Path, delays: dict[Stream, float], first: int = FIRST, arrive_late: bool = False, without: Stream | None = None
) -> Path:
    """The first messages of every topic of the bundled session, their stamps, or log times too, later by `delays`."""
    inputs = {stream: topic for stream, topic in load_topics().inputs.items() if scan(SESSION).find(topic.name) is not None}
    streams = {topic.absolute: stream for stream, topic in inputs.items()}
    with MessageWriter(path, {stream.value: topic for stream, topic in inputs.items()}, {"origin": "synthetic, a test"}) as bag:
        count = dict.fromkeys(Stream, 0)
        for name, log, _, msg in read_both(scan(SESSION), {name: TYPES[stream] for name, stream in streams.items()}):
            stream = streams[name]
            count[stream] += 1
            if count[stream] <= first and stream is not without:
                late = round(delays.get(stream, 0.0) * SECOND)
                fill_header(msg.header, stamp_of(msg) + late)
                bag.write_encoded(stream.value, log + late * arrive_late, bytes(jazzy().serialize_cdr(msg, TYPES[stream])))
    return path


def test_a_delay_that_is_mapped_leaves_no_trace(tmp_path: Path) -> None:
    """Outputs are those of the session with right stamps, bit for bit; without the mapping they are not."""
    scene, right, late = load_scene(), written(tmp_path / "right", {}), written(tmp_path / "late", DELAYS)
    assert all(scan(right).find(load_topics().inputs[stream].name).count for stream in DELAYS)
    digests = [replay(bag, scene, tmp_path / f"{bag.name}_out").summary["output_sha256"] for bag in (right, late)]
    assert digests[0] != digests[1]
    SessionMetadata("test", "", "", MAPPING, {}).write(late)
    found = replay(late, scene, tmp_path / "mapped_out").summary
    assert found["mapping"].endswith("session.yaml, mapping")
    assert found["output_sha256"] == digests[0]


@pytest.fixture(scope="module")
def without(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Stream], float]:
    """Error of the estimate (m) without one stream."""

    @cache
    def error(stream: Stream) -> float:
        folder = tmp_path_factory.mktemp("without")
        return estimate_error(written(folder / "bag", {}, ALL, without=stream), folder / "out", None)

    return error


def estimate_error(bag: Path, out: Path, mapping: Path | None) -> float:
    shutil.copy(SESSION / "truth.csv.gz", bag)
    return float(replay(bag, None, out, mapping=mapping, with_bag=False, health=False).summary["tip_estimate_error_rms_m"])


@pytest.mark.parametrize(("stream", "delay"), [(Stream.IMU, 0.03), (Stream.IMU, 0.09), (Stream.ANGLES, 0.09)])
def test_a_stream_that_arrives_late_makes_the_estimate_no_worse(
    without: Callable[[Stream], float], stream: Stream, delay: float, tmp_path: Path
) -> None:
    """By rows of measurement at the wrong instant the tip would be three times as far off with the IMU as without it."""
    mapping = tmp_path / "mapping.yaml"
    mapping.write_text(f"inputs: {{{stream.value}: {{delay: {delay}}}}}\n")
    late = written(tmp_path / "late", {stream: delay}, ALL, arrive_late=True)
    assert estimate_error(late, tmp_path / "out", mapping) < 1.1 * without(stream)
