"""A stream whose stamps lag by a constant: the mapping tells by how much, and a replay is that of stamps that are right."""

from __future__ import annotations

from pathlib import Path

from recordings import MessageWriter, SessionSheet, read_both, scan
from ros_messages import TYPES, fill_header, jazzy, load_topics, stamp_of

from boom_twin import Stream, load_scene, replay
from boom_twin.types import SECOND

SESSION = Path(__file__).parents[2] / "bags" / "pump_session"
FIRST = 1500
DELAYS = {Stream.ANGLES: 0.02, Stream.IMU: -0.0075, Stream.FORCES: 0.004}
MAPPING = "inputs:\n" + "".join(f"  {stream.value}: {{delay: {delay}}}\n" for stream, delay in DELAYS.items())


def written(path: Path, delays: dict[Stream, float]) -> Path:
    """The first messages of every topic of the bundled session, their stamps later by `delays`; log times as they were."""
    inputs = {stream: topic for stream, topic in load_topics().inputs.items() if scan(SESSION).find(topic.name) is not None}
    streams = {topic.absolute: stream for stream, topic in inputs.items()}
    with MessageWriter(path, {stream.value: topic for stream, topic in inputs.items()}, {"origin": "synthetic, a test"}) as bag:
        count = dict.fromkeys(Stream, 0)
        for name, log, _, msg in read_both(scan(SESSION), {name: TYPES[stream] for name, stream in streams.items()}):
            stream = streams[name]
            count[stream] += 1
            if count[stream] <= FIRST:
                fill_header(msg.header, stamp_of(msg) + round(delays.get(stream, 0.0) * SECOND))
                bag.write_encoded(stream.value, log, bytes(jazzy().serialize_cdr(msg, TYPES[stream])))
    return path


def test_a_delay_that_is_mapped_leaves_no_trace(tmp_path: Path) -> None:
    """Outputs are those of the session with right stamps, bit for bit; without the mapping they are not."""
    scene, right, late = load_scene(), written(tmp_path / "right", {}), written(tmp_path / "late", DELAYS)
    assert all(scan(right).find(load_topics().inputs[stream].name).count for stream in DELAYS)
    digests = [replay(bag, scene, tmp_path / f"{bag.name}_out").summary["output_sha256"] for bag in (right, late)]
    assert digests[0] != digests[1]
    SessionSheet("test", "", "", MAPPING, {}).write(late)
    found = replay(late, scene, tmp_path / "mapped_out").summary
    assert found["mapping"].endswith("session.yaml, mapping")
    assert found["output_sha256"] == digests[0]
