"""The topic is in the table, filled by the node's encoder, and with the same numbers in the bag of a replay."""

import subprocess
import sys
from pathlib import Path

import numpy as np

from boom_twin import Sample, Settings, Stream, Twin, load_scene
from boom_twin.bag.reader import read, scan
from boom_twin.bag.session_writer import samples_in_rows, write_samples
from boom_twin.messages.report_encoder import ReportEncoder
from boom_twin.messages.sample_decoder import stamp_of
from boom_twin.messages.topic_table import Output, load_topics
from boom_twin.messages.type_store import jazzy
from boom_twin.scene.kinematics import strokes_of_posture

KIND, NAME = "geometry_msgs/msg/TwistStamped", "/boom_twin/tip/velocity"
topic = load_topics().outputs[Output.TIP_VELOCITY]
assert (topic.absolute, topic.type) == (NAME, KIND)


def numbers(message):
    twist = message.twist
    return stamp_of(message), message.header.frame_id, twist.linear.x, twist.linear.z, twist.angular.y


scene = load_scene()
stamps = 10**9 + 5_000_000 * np.arange(400)
strokes = strokes_of_posture(scene, "arch") + np.outer(0.02 * np.sin(np.linspace(0.0, 3.0, 400)), [1.0, 0.0, 0.5, 0.0])
twin, encoder, sent, joints = Twin(scene), ReportEncoder(scene, Settings()), [], []
for stamp, row in zip(stamps.tolist(), strokes, strict=True):
    report = twin.update(Sample(Stream.STROKES, stamp, row))
    (encoded,) = (data for output, data in encoder.fill(report) if output is Output.TIP_VELOCITY)
    p = report.prediction
    sent.append(numbers(jazzy().deserialize_cdr(encoded, KIND)))
    assert sent[-1] == (stamp, "base_link", *p.tip_velocity, -p.tip_angular_velocity)
    joints.append(p.joints)
assert max(abs(row[3]) for row in sent) > 0.01

rows = {Stream.STROKES: strokes, Stream.ANGLES: np.array(joints)}
write_samples(Path("session"), samples_in_rows(stamps, rows), rows, {"origin": "synthetic"})
options = ("--out", "result", "--no-pictures", "--no-health")
subprocess.run([sys.executable, "-m", "boom_twin.cli.main", "replay", "session", *options], check=True)
assert [numbers(message) for _, _, message in read(scan(Path("result/bag")), {NAME: KIND})] == sent
