"""The sensor is read in its unit, has residuals in the bag of a replay, a zero, and statuses of its own."""

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np

from boom_twin import Sample, Settings, Stream, Twin, load_scene
from boom_twin.bag.reader import read, scan
from boom_twin.bag.session_writer import write_samples
from boom_twin.calibration.run import judged
from boom_twin.calibration.sessions import Rigging, read_sessions
from boom_twin.config.settings import Thresholds
from boom_twin.diagnostics.sensor_status import sensors_of
from boom_twin.diagnostics.topic_status import Peers
from boom_twin.diagnostics.twin_status import TwinWatch
from boom_twin.messages.mapping import load_mapping
from boom_twin.messages.sample_decoder import SampleDecoder, stamp_of
from boom_twin.messages.topic_table import load_topics
from boom_twin.monitor.data.bag_feed import bag_feed
from boom_twin.monitor.protocol import layout
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.scene.load import default_text
from boom_twin.types import StrokeReading, channels_of

CHANNEL, WRONG, SLOPE, NANO = "tip_inclination", 0.05, 0.02, 1e-9
INCLINATION, count = Stream.TIP_INCLINATION, 400
scene = load_scene()
scene = scene.model_copy(update={"base": scene.base.model_copy(update={"inclination": SLOPE})})
assert channels_of(4)[INCLINATION] == (CHANNEL,)

# A session: the sensor reads WRONG too much of a boom whose base stands inclined by SLOPE.
times = 0.005 * np.arange(count)
strokes = strokes_of_posture(scene, "arch") + np.outer(0.01 * np.sin(2.0 * times), [1.0, 0.0, 0.5, 0.0])
noise, model, samples = np.random.default_rng(0), Twin(scene), []
for stamp, row in zip((10**9 + np.round(times / NANO)).astype(int).tolist(), strokes, strict=True):
    p = model.update(Sample(Stream.STROKES, stamp, row)).prediction
    reading = p.tip_angle + SLOPE + WRONG + 1e-4 * noise.standard_normal()
    samples += [Sample(Stream.STROKES, stamp, row), Sample(Stream.ANGLES, stamp, p.joints)]
    samples.append(Sample(INCLINATION, stamp, np.array([reading])))

# Through a twin, watched as the node watches its own.
topics = load_topics()
required = {stream: topic.required for stream, topic in topics.inputs.items()}
sensors, names = sensors_of(4, required), {s: topic.name for s, topic in topics.inputs.items()}
now = 0.0
watch, twin = TwinWatch(sensors, names, Thresholds(), lambda: now), Twin(scene, health=True)
watch.begin()
found = []
for sample in samples:
    now = (sample.stamp - samples[0].stamp) * NANO
    watch.seen(sample.stream, sample.stamp)
    report = twin.update(sample)
    watch.took(sample, report, 0.0)
    found += [residuals for residuals in report.residuals if residuals.stream is INCLINATION]
assert {residuals.names for residuals in found} == {(CHANNEL,)} and len(found) == count
values, ratios = (np.array([getattr(residuals, part)[0] for residuals in found]) for part in ("values", "normalised"))
assert np.abs(values - WRONG).max() < 6e-4 and ratios[count // 2 :].min() > 5.0  # once the motion is known
looked = watch.look({}, "", {stream: Peers(name) for stream, name in names.items()}, (), now)
statuses = {status.name: status.message for status in looked}
assert statuses[f"sensor {CHANNEL}"] == "measuring"
assert {"tip_inclination", "residual tip_inclination"} <= set(statuses)
assert math.isclose(twin.rezero("tip")[CHANNEL], WRONG, abs_tol=5e-4)

# From a bag, in degrees.
mapping = Path("mapping.yaml")
mapping.write_text(f"sensors: {{{CHANNEL}: {{unit: deg}}}}\n")
write_samples(Path("session"), samples, (Stream.STROKES, Stream.ANGLES, INCLINATION), {"origin": "synthetic"})
((_, _, message), *_) = read(scan(Path("session")), {f"/{CHANNEL}": "sensor_msgs/msg/JointState"})
decoder = SampleDecoder(4, load_mapping(mapping, 4))
assert math.isclose(decoder.sample_of(INCLINATION, stamp_of(message), message).values[0], math.radians(message.position[0]))

lines = default_text().replace("\nbase:\n", f"\nbase:\n  inclination: {SLOPE}\n")
Path("scene.yaml").write_text(lines)
options = ("--scene", "scene.yaml", "--out", "result", "--report")
subprocess.run([sys.executable, "-m", "boom_twin.cli.main", "replay", "session", *options], check=True)
kept = read(scan(Path("result/bag")), {"/boom_twin/residuals": "sensor_msgs/msg/JointState"})
kept = [message.position[0] for _, _, message in kept if message.name == [CHANNEL]]
assert len(kept) == count and np.abs(np.array(kept) - WRONG).max() < 6e-4

# In report and comparisons, with its unit.
rows = json.loads(Path("result/quantities.json").read_text())["quantities"]
mean = next(row for row in rows if row["name"] == f"residual_mean_{CHANNEL}")
assert math.isclose(mean["value"], WRONG, abs_tol=5e-4) and mean["unit"] == "rad" and mean["sigma"] is None
# On the live page: a table of residuals, from which it makes chart, figures and columns of the export.
feed = bag_feed(Path("session"), scene, Settings())
while feed.is_reading:
    feed.poll()
(table,) = (each for each in layout(feed.store)["tables"] if each["name"] == INCLINATION.value)
assert table["columns"] == (f"{CHANNEL}_rad", f"{CHANNEL}_normalised")
assert table["residuals"] == {"title": "tip inclinometer", "factor": 1.0, "unit": "rad"}
assert not feed.topic_rows.dropped.by_topic

# A sensor that falls silent is told, and what a calibration holds out is compared with it.
twin, alarms = Twin(scene, health=True), set()
for sample in samples:
    if sample.stream is not INCLINATION or sample.stamp < samples[0].stamp + 10**9:
        health = twin.update(sample).health
        alarms |= {(alarm.kind, alarm.cause) for alarm in (health.alarms if health else ())}
assert alarms == {("dropout", f"{CHANNEL}.sensor")}
(session,) = read_sessions([Path("session")], topics, 4)
rigging = Rigging(Settings(), (None,) * 4, StrokeReading.LENGTH)
compared = judged(scene, rigging, session, {}, 0)
assert compared.names[-1] == CHANNEL and compared.spread[-1] > 5.0
