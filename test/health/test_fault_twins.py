"""Causes named by fault twins in bundled sessions, read with their own scene and with scenes of a stiffer boom."""

import json
import math
import threading
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import anew, parameter, with_parameters
from health.recorded import session

from boom_twin import Sample, Settings, Stream, Twin, load_scene, statics
from boom_twin.health.causes import MEMORY
from boom_twin.health.fault_twins import FaultTwins
from boom_twin.twin.blocks import block_of
from boom_twin.types import SECOND

BAGS = Path(__file__).parents[2] / "bags"
SOFTER = 0.3  # share
PART = ["--duration", "20"]  # s, with the first moves


def alarms_of(folder, scene, *options, bag="arch_session"):
    """Return the alarms of a session's first part, replayed with a scene by the command."""
    file = folder / "scene.yaml"
    file.write_text(anew(scene))
    argv = ["replay", str(BAGS / bag), "--scene", str(file), "--out", str(folder / "out"), *PART, "--no-bag", "--no-pictures"]
    assert main([*argv, *options]) == 0
    return json.loads((folder / "out" / "summary.json").read_text())["alarms"]


def stiffer(cause):
    """Return the default scene with one part so stiff that the session's boom is 30 % softer."""
    scene = load_scene()
    return with_parameters(scene, {cause: parameter(scene, cause) / (1.0 - SOFTER)})


@pytest.mark.parametrize("bag", ["arch_session", pytest.param("pump_session", marks=pytest.mark.slow)])
def test_a_boom_as_its_scene_has_no_cause(tmp_path, bag):
    """A healthy session gives no alarm, quiet or under a pump that the model does not know; no thread is left."""
    before = threading.active_count()
    assert alarms_of(tmp_path, load_scene(), "--causes", bag=bag) == []
    assert threading.active_count() <= before


def test_a_boom_at_rest_under_less_load_than_expected_has_no_cause():
    """White noise of the sensors alone, and a filter that expects four times the usual load: no payload explains that."""
    scene, rng, sigmas = load_scene(), np.random.default_rng(1), Settings()
    rest = statics(scene, posture="arch")
    angle = Twin(scene).update(Sample(Stream.STROKES, 0, tuple(rest.lengths))).prediction.tip_angle
    readings = {
        Stream.STROKES: (rest.lengths, sigmas.stroke_sigma),
        Stream.ANGLES: (rest.joints, sigmas.angle_sigma),
        Stream.IMU: (9.81 * np.array([math.sin(angle), math.cos(angle)]), sigmas.imu_sigma),
    }
    with closing(Twin(scene, Settings(expected_load=0.01), health=True, causes=True)) as twin:
        for stamp in range(SECOND, 21 * SECOND, SECOND // 50):
            for stream, (values, sigma) in readings.items():
                report = twin.update(Sample(stream, stamp, tuple(values + sigma * rng.standard_normal(len(values)))))
                assert report.health is None or report.health.alarms == ()


@pytest.mark.parametrize(
    "cause", ["cylinder_2.k", *(pytest.param(each, marks=pytest.mark.slow) for each in ("cylinder_1.k", "section_1.EI"))]
)
def test_a_softer_part_is_named(tmp_path, capsys, cause):
    """A part that is 30 % softer than the scene says is named with its size in summary.json and in the output."""
    (alarm,) = alarms_of(tmp_path, stiffer(cause), "--causes")
    assert (alarm["cause"], alarm["kind"], alarm["channel"]) == (cause, "softer", cause.partition(".")[0])
    assert alarm["ranked"][0]["cause"] == cause and alarm["ranked"][0]["probability"] >= 0.95
    assert sum(rank["probability"] for rank in alarm["ranked"]) == pytest.approx(1.0)
    assert f"{alarm['told']} ({alarm['evidence']})" in capsys.readouterr().out
    size = float(alarm["evidence"].split()[1])  # k -29 % (+- 1)
    assert size == pytest.approx(-100 * SOFTER, abs=10)


def test_sample_by_sample_as_by_blocks():
    """A twin that takes samples one by one names the same causes, with the same reports of health, as one that takes blocks."""
    scene, samples = stiffer("cylinder_2.k"), session(20.0)
    one, many = (Twin(scene, health=True, causes=True) for _ in range(2))
    single = [report.health for sample in samples if (report := one.update(sample)).health is not None]
    found = []
    for first in range(0, len(samples), 997):
        found += many.take(block_of(samples[first : first + 997], len(scene.joints))).health.values()
    assert [(each.stamp, each.alarms) for each in found] == [(each.stamp, each.alarms) for each in single]
    assert "cylinder_2.k" in {alarm.cause for each in single for alarm in each.alarms}
    assert np.array_equal([each.tip_sigmas for each in found], [each.tip_sigmas for each in single])


@pytest.mark.system
def test_a_process_beside_a_live_twin_names_what_a_replay_names():
    """A live twin whose process keeps up tells the same causes with the same samples as a replay, with equal figures."""
    scene, told = stiffer("cylinder_2.k"), []
    for is_live in (False, True):
        twin, named = Twin(scene, health=True, causes=True, is_live=is_live), {}
        for sample in session(20.0):
            for _, verdict in twin.judge.fault_twins._results:
                verdict.result()
            health = twin.update(sample).health
            named |= {each: health.stamp for each in health.alarms if each.cause and each not in named} if health else {}
        twin.close()
        told.append(named)
    assert told[0] == told[1] != {}


@pytest.mark.system
def test_a_live_twin_goes_on_with_other_fault_twins_when_their_process_is_killed():
    twin = Twin(stiffer("cylinder_2.k"), health=True, causes=True, is_live=True)
    named, fault_twins = set(), twin.judge.fault_twins
    for k, sample in enumerate(session(25.0)):
        for _, verdict in fault_twins._results:
            verdict.result()
        if k == 300:
            fault_twins._search.close()
        health = twin.update(sample).health
        named |= {each.cause for each in health.alarms} if health else set()
    twin.close()
    assert "cylinder_2.k" in named


def test_a_process_that_does_not_keep_up_is_given_a_minute_at_most():
    """While the newest minute waits for the process, further seconds are left out: memory does not grow."""
    free, taken, samples = threading.Event(), [], session(1.0)
    twins = FaultTwins(load_scene(), None, Settings(), is_live=True)

    def search(second):
        free.wait(60.0)
        taken.append(second.stamp)
        return []

    twins._search = search
    for second in range(100):
        for sample in samples:
            stamp = sample.stamp % SECOND + second * SECOND
            twins.reach(stamp, lambda: None)
            twins.take(block_of([replace(sample, stamp=stamp)], 4))
    free.set()
    twins._worker.shutdown()
    assert taken == [second * SECOND for second in range(MEMORY)]
    assert twins.news(100 * SECOND) == [] and not twins._results


def test_a_fault_twin_has_the_evidence_of_a_twin_without_its_reports():
    """Reports of a fault twin are empty, and its likelihood is that of a twin with reports, bit for bit."""
    scene, samples = load_scene(), session(2.0)
    block, usual, follower = block_of(samples, len(scene.joints)), Twin(scene), Twin(scene, is_follower=True)
    usual._is_new = False  # as after a pause: the boom may move
    assert len(usual.take(block).predictions.stamps) > 100 and len(follower.take(block).predictions.stamps) == 0
    assert follower.evidence == usual.evidence != 0.0


def test_a_fault_twin_may_start_amid_a_move():
    """Readings 1 s after its start are as likely as to a twin that has followed the whole session, within 100 nats.

    A twin that takes the boom for resting loses a thousand.
    """
    scene, samples, likely = load_scene(), session(7.0), list[float]()
    stamps = np.array([each.stamp for each in samples])
    first, second, third = np.searchsorted(stamps, stamps[0] + np.array([5, 6, 7]) * SECOND)
    for begin in (0, first):
        twin = Twin(scene, is_follower=True)
        twin.take(block_of(samples[begin:second], len(scene.joints)))
        before = twin.evidence
        twin.take(block_of(samples[second:third], len(scene.joints)))
        likely.append(twin.evidence - before)
    assert abs(likely[1] - likely[0]) < 100.0
