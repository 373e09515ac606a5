"""What the node would publish of a session, message by message, against the bag of a replay."""

from __future__ import annotations

from pathlib import Path

from recordings import read, scan
from ros_messages import ReportEncoder, SampleDecoder, Topics, jazzy, stamp_of

from boom_twin import Settings, Twin, load_scene
from boom_twin.types import StrokeReading


def assert_same_bytes(session: Path, out: Path, topics: Topics, reads: StrokeReading, count: int) -> None:
    """The first messages of the result bag are those of the three calls, as bytes: neither blocks nor threads change them."""
    scene, store = load_scene(), jazzy()
    live, decoder, encoder = Twin(scene, health=True, reads=reads), SampleDecoder(4, topics), ReportEncoder(scene, Settings())
    heard = {topics.inputs[streams[0]].absolute: streams for streams in topics.streams_by_topic.values()}
    types = {name: topics.inputs[streams[0]].type for name, streams in heard.items() if scan(session).find(name)}
    expected: list[tuple[str, bytes]] = []
    for name, _, msg in read(scan(session), types):
        for sample in decoder.samples(heard[name], stamp_of(msg), msg):
            expected += [(topics.outputs[key].absolute, data) for key, data in encoder.fill(live.update(sample))]
        if len(expected) > count:
            break
    kinds = {topic.absolute: topic.type for key, topic in topics.outputs.items() if key != "diagnostics"}
    found = read(scan(out / "bag"), kinds)
    for topic, data in expected:
        name, _, msg = next(found)
        assert (name, bytes(store.serialize_cdr(msg, kinds[name]))) == (topic, data)
