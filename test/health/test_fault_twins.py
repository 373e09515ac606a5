"""Causes named by fault twins: of bundled sessions, read with their own scene and with scenes of a stiffer boom."""

import json
from pathlib import Path

import numpy as np
import pytest

from boom_twin import load_scene
from boom_twin.cli.main import main
from boom_twin.health.fault_twins import FaultTwins
from boom_twin.scene.edit import anew, parameter, with_parameters
from boom_twin.twin.blocks import SampleBlock
from boom_twin.types import SECOND, Change

BAGS = Path(__file__).parents[2] / "bags"
SOFTER = 0.3  # share
PART = ["--duration", "14"]  # s, with the first moves


def alarms_of(folder, scene, *options, session="arch_session"):
    """Return the alarms of a session's first part, replayed with a scene by the command."""
    file = folder / "scene.yaml"
    file.write_text(anew(scene))
    plain = ["--no-health", "--no-bag", "--no-pictures"]
    argv = ["replay", str(BAGS / session), "--scene", str(file), "--out", str(folder / "out"), *PART, *plain, *options]
    assert main(argv) == 0
    return json.loads((folder / "out" / "summary.json").read_text())["alarms"]


def stiffer(cause):
    """Return the default scene with one part so stiff that the session's boom is 30 % softer."""
    scene = load_scene()
    return with_parameters(scene, {cause: parameter(scene, cause) / (1.0 - SOFTER)})


def test_a_boom_as_its_scene_has_no_cause(tmp_path):
    """A healthy session gives no cause."""
    assert alarms_of(tmp_path, load_scene(), "--causes") == []


@pytest.mark.slow
def test_a_pump_is_no_cause(tmp_path):
    """A boom as its scene under a pump that the model does not know gives no cause."""
    assert alarms_of(tmp_path, load_scene(), "--causes", session="pump_session") == []


@pytest.mark.parametrize(
    "cause", ["cylinder_2.k", *(pytest.param(each, marks=pytest.mark.slow) for each in ("cylinder_1.k", "section_1.EI"))]
)
def test_a_softer_part_is_named(tmp_path, capsys, cause):
    """A part that is 30 % softer than the scene says is named in summary.json and in the output."""
    (alarm,) = alarms_of(tmp_path, stiffer(cause), "--causes")
    assert (alarm["cause"], alarm["kind"], alarm["channel"]) == (cause, "softer", cause.partition(".")[0])
    assert alarm["ranked"][0] == {"cause": cause, "probability": pytest.approx(1.0, abs=0.05)}
    assert f"{cause.partition('.')[0].replace('_', ' ')} is softer than the scene says" in capsys.readouterr().out


class Follower:
    """A twin whose evidence grows at a rate (nats/s) from an onset (s) on; keeps the changes that it is told."""

    def __init__(self, hypothesis, rates, onset):
        self.evidence, self.changes, self._rate = 0.0, [], rates.get(hypothesis.cause, 0.0)
        self._onset, self._seconds = onset, 0

    def update_block(self, _block):
        """Take a second of samples."""
        self._seconds += 1
        self.evidence += self._rate if self._seconds > self._onset else 0.0

    @property
    def requests(self):
        return self

    def repeat(self, change):
        """Keep the change."""
        self.changes.append(change)


def judged(rates, seconds=40, onset=12):
    """Return what is named where hypotheses gain at these rates from the onset on."""
    twins = FaultTwins(load_scene(), lambda hypothesis: Follower(hypothesis, rates, onset))
    stamps = np.arange(seconds, dtype=np.int64) * SECOND
    twins.take(SampleBlock(np.zeros_like(stamps), stamps, np.zeros((seconds, 4))))
    return twins.judge()


def test_since_when():
    """An alarm begins where the evidence does."""
    alarm = judged({"section_2.EI": 10.0})
    assert (alarm.cause, alarm.since) == ("section_2.EI", 12 * SECOND)


@pytest.mark.parametrize("other", ["joint_2.sensor", "tip_imu_x.sensor", "tip.payload", "section_2.EI"])
def test_no_name_where_another_cause_explains_as_much(other):
    """A sensor, a load or another part that explains the readings nearly as well keeps a name away."""
    assert judged({"cylinder_2.k": 10.0, other: 9.5}) is None
    assert judged({"cylinder_2.k": 10.0, other: 8.0}).cause == "cylinder_2.k"


@pytest.mark.parametrize("cause", ["tip.payload", "line_fill", "joint_1.sensor"])
def test_loads_and_sensors_are_not_named(cause):
    """A load or a sensor that explains the readings is not named."""
    assert judged({cause: 100.0}) is None


def test_little_evidence_names_nothing():
    """A name needs 75 nats."""
    assert judged({"cylinder_3.k": 2.5}) is None
    assert judged({"cylinder_3.k": 2.8}).cause == "cylinder_3.k"
    assert judged({"cylinder_3.k": 100.0}, seconds=1) is None


def test_a_recorded_load_is_the_load_of_all_twins():
    """A change of the load while recording reaches every twin, with what its hypothesis adds."""
    twins = FaultTwins(load_scene(), lambda hypothesis: Follower(hypothesis, {}, 0))
    twins.change(Change(0, False, {"payload": 30.0, "line_fill": -1.0, "tip_load_limit": 500.0}, {}))
    for hypothesis, twin in zip(twins.hypotheses, twins.twins, strict=True):
        (change,) = twin.changes
        assert change.settings["payload"] == pytest.approx(30.0 + hypothesis.payload)
        assert change.settings["tip_load_limit"] == 500.0
        assert (hypothesis.payload > 0.0) == (hypothesis.cause == "tip.payload" and hypothesis.kind == "more")
