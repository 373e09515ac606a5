"""The fault is put on a (synthetic) session of drives by the virtual rig, and health tells the IMU that it spoils."""

import sys
from pathlib import Path

import numpy as np

from boom_twin import Sample, Stream, Twin, load_scene
from boom_twin.bag.reader import read, scan
from boom_twin.messages.sample_decoder import SampleDecoder, stamp_of
from boom_twin.messages.topic_table import load_topics
from boom_twin.types import StrokeReading
from boom_twin.validation.rig.faults import parse, spoil
from boom_twin.validation.rig.session import RigSession

SHARE, ONSET, LAST, NANO = 0.4, 4.0, 20.0, 1e-9
RECORDED = (Stream.STROKES, Stream.ANGLES, Stream.IMU)
session, topics, scene, found = scan(Path(sys.argv[1])), load_topics().inputs, load_scene(), {stream: [] for stream in RECORDED}
streams, decoder = {f"/{topics[stream].name}": stream for stream in RECORDED}, SampleDecoder(len(scene.joints))
for name, log, message in read(session, {name: topics[stream].type for name, stream in streams.items()}):
    if (log - session.start) * NANO > LAST:
        break
    sample = decoder.put(streams[name], stamp_of(message), message)
    found[sample.stream].append((sample.stamp, sample.values))
stamps = np.array([stamp for stamp, _ in found[Stream.STROKES]])
strokes, joints, imu = (np.array([values for _, values in found[s]]) for s in RECORDED)
times = (stamps - stamps[0]) * NANO

fault = parse(f"tip_imu.x:scale:{SHARE}@{ONSET}")
spoilt = spoil(RigSession(stamps, strokes, joints, imu, stamps, 0.0 * joints, {"t": times}), [fault], 0)
assert np.array_equal(spoilt.imu[times < ONSET], imu[times < ONSET]) and np.array_equal(spoilt.joints, joints)
assert np.allclose(spoilt.imu[-1], [(1.0 + SHARE) * imu[-1, 0], imu[-1, 1]])


def alarms(readings):
    """Return channel and kind of every alarm, with its beginning (s)."""
    twin, found = Twin(scene, health=True, reads=StrokeReading.DRIVE), {}
    for stamp, *rows in zip(stamps.tolist(), strokes, joints, readings, strict=True):
        for stream, values in zip(RECORDED, rows, strict=True):
            health = twin.update(Sample(stream, stamp, values)).health
            for alarm in () if health is None else health.alarms:
                found.setdefault((alarm.channel, alarm.kind), (alarm.since - stamps[0]) * NANO)
    return found


assert alarms(imu) == {}
(told,) = alarms(spoilt.imu).items()
assert told[0] == ("tip_imu", "range") and told[1] >= ONSET
