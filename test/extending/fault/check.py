"""The fault is put on a (synthetic) session of drives by the virtual rig, and the residuals show it."""

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
    sample = decoder.sample_of(streams[name], stamp_of(message), message)
    found[sample.stream].append((sample.stamp, sample.values))
stamps = np.array([stamp for stamp, _ in found[Stream.STROKES]])
strokes, joints, imu = (np.array([values for _, values in found[s]]) for s in RECORDED)
times = (stamps - stamps[0]) * NANO

fault = parse(f"tip_imu.x:scale:{SHARE}@{ONSET}")
spoilt = spoil(RigSession(stamps, strokes, joints, imu, stamps, 0.0 * joints, {"t": times}), [fault], 0)
assert np.array_equal(spoilt.imu[times < ONSET], imu[times < ONSET]) and np.array_equal(spoilt.joints, joints)
assert np.allclose(spoilt.imu[-1], [(1.0 + SHARE) * imu[-1, 0], imu[-1, 1]])


def normalised(readings):
    """Return the root mean square of the normalised residuals of the IMU's x from the onset on."""
    twin, found = Twin(scene, health=False, reads=StrokeReading.DRIVE), []
    for stamp, *rows in zip(stamps.tolist(), strokes, joints, readings, strict=True):
        for stream, values in zip(RECORDED, rows, strict=True):
            report = twin.update(Sample(stream, stamp, values))
            own = [each for each in report.residuals if each.stream is Stream.IMU]
            found += [each.normalised[0] for each in own if (each.stamp - stamps[0]) * NANO > ONSET]
    return float(np.sqrt(np.nanmean(np.square(found))))


assert normalised(spoilt.imu) > 3.0 * normalised(imu)
