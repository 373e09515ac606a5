"""Model, topics and residuals, judged as the node has them judged."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boom_twin import Report, Sample, Stream
from boom_twin.config.settings import Thresholds
from boom_twin.diagnostics.levels import Level, Status
from boom_twin.diagnostics.sensor_status import sensors_of
from boom_twin.diagnostics.topic_status import Peers
from boom_twin.diagnostics.twin_status import TwinWatch
from boom_twin.texts import alarm_text
from boom_twin.types import USUAL_STREAMS, Alarm, Health, Residuals

NAMES = {stream: stream.value for stream in USUAL_STREAMS}
REQUIRED = {stream: stream in (Stream.STROKES, Stream.ANGLES) for stream in USUAL_STREAMS}
JOINTS = ("joint_1", "joint_2", "joint_3", "joint_4")


class Rig:
    """A watch whose time is set here, fed by made-up sensors."""

    def __init__(self) -> None:
        self.now, self.random = 100.0, np.random.default_rng(5)
        sensors = sensors_of(4, REQUIRED)
        self.watch = TwinWatch(sensors, NAMES, Thresholds(), lambda: self.now)
        self.peers = {stream: Peers(f"/{stream.value}", ("/driver",)) for stream in USUAL_STREAMS}
        self.behind = dict.fromkeys(Stream, 0.0)
        self.scale, self.took, self.failing, self.swing = 1.0, 1e-4, False, 0.0

    def prediction(self) -> Any:
        return SimpleNamespace(tip_displacement=np.array([0.0, -0.1 + self.swing * np.sin(2.0 * np.pi * self.now)]))

    def second(self, streams: tuple[Stream, ...] = (Stream.STROKES, Stream.ANGLES)) -> dict[str, Status]:
        """One second at 100 Hz, and the look after it."""
        for _ in range(100):
            self.now += 0.01
            for stream in streams:
                self._message(stream)
        return self.look()

    def look(self) -> dict[str, Status]:
        found = self.watch.look({"scene": "s"}, "", self.peers, [Peers("/out", ("/screen",))], self.now + 1e9)
        return {status.name: status for status in found}

    def _message(self, stream: Stream) -> None:
        stamp = round((self.now + 1e9 - self.behind[stream]) * 1e9)
        sample = Sample(stream, stamp, self.random.normal(0.3, 1e-4, 4))
        self.watch.seen(stream, stamp)
        self.watch.took(sample, self._report(stream, stamp), self.took)

    def _report(self, stream: Stream, stamp: int) -> Report:
        if stream is Stream.STROKES:
            if self.failing:
                return Report(stamp, False, status="the sweep found a singular pivot")
            return Report(stamp, True, prediction=self.prediction())  # type: ignore[arg-type]
        values = self.scale * self.random.normal(0.0, 1.0, 4)
        return Report(stamp, True, residuals=(Residuals(stream, stamp, JOINTS, values, np.ones(4)),))


@pytest.fixture
def rig() -> Rig:
    return Rig()


def after(rig: Rig, seconds: int, **changes: Any) -> dict[str, Status]:
    for name, value in changes.items():
        setattr(rig, name, value)
    for _ in range(seconds - 1):
        rig.second()
    return rig.second()


def test_a_healthy_rig(rig: Rig) -> None:
    assert rig.watch.acknowledge() == "no alarm has ended: health was not judged"  # before the first strokes
    found = after(rig, 5)
    sick = {name: status.message for name, status in found.items() if status.level != Level.OK}
    assert sick == {}
    names = ["model", *NAMES.values(), "outputs", "swing"]
    names += [f"sensor {kind}_{i}" for kind in ("cylinder", "joint") for i in (1, 2, 3, 4)]
    names += [
        "sensor tip_imu_x",
        "sensor tip_imu_z",
        *(f"sensor cylinder_force_{i}" for i in (1, 2, 3, 4)),
        "sensor tip_imu_rate",
    ]
    names += [*(f"residual {name}" for name in JOINTS)]
    assert list(found) == names
    assert found["tip_imu"].message == "absent; optional"
    model = found["model"].values
    assert (model["predictions"], model["failures"]) == (500, 0)
    assert model["load"] == pytest.approx(0.02) and model["step_budget_s"] == pytest.approx(0.01)
    assert found["residual joint_1"].values["rms_normalised"] == pytest.approx(1.0, abs=0.15)
    assert found["residual joint_1"].values["count"] == 500


def test_a_residual_that_grows_and_shrinks_again(rig: Rig) -> None:
    """The window is told as long as it is: two seconds after the beginning nothing has lasted for ten."""
    told = [rig.second()["residual joint_3"] for rig.scale in [5.0] * 14 + [1.0] * 20]
    assert [status.values["window_s"] for status in told[:14]] == pytest.approx([*range(1, 11), 10, 10, 10, 10])
    raised = next(status for status in told if status.level == Level.ERROR)
    assert raised.message == "larger than noise explains" and raised.values["window_s"] < 5.0
    assert told[13].message == raised.message and told[-1].level == Level.OK


def test_an_alarm_of_a_sensor_is_told_with_the_sensor_while_it_lasts(rig: Rig) -> None:
    after(rig, 2)
    alarm, deviation = (
        Alarm("cylinder_2", "stuck", 1, None, "cylinder_2.sensor", ""),
        Alarm("joint_1", "deviation", 1, None, None, ""),
    )
    for until, level, words in ((None, Level.ERROR, alarm_text("cylinder_2", "stuck", None)), (2, Level.OK, "measuring")):
        rig.watch.judged(Health(1, (replace(alarm, until=until), deviation), np.zeros(2), {}), 0.0)
        found = rig.second()
        assert (found["sensor cylinder_2"].level, found["sensor cylinder_2"].message) == (level, words)
        assert found["sensor joint_1"].level == Level.OK


@pytest.mark.parametrize(("swing", "level"), [(0.1, Level.OK), (0.2, Level.WARN), (0.4, Level.ERROR)])
def test_how_far_the_tip_swings_is_told_against_its_limits(rig: Rig, swing: float, level: Level) -> None:
    status = after(rig, 5, swing=swing)["swing"]
    assert status.level == level and status.values["swing_m"] == pytest.approx(swing, rel=0.01)
    assert (status.values["swing_m_warn"], status.values["swing_m_error"]) == (0.15, 0.3)
    assert after(rig, 12, swing=0.0)["swing"].level == Level.OK


def test_a_failure_of_the_model_is_urgent_once(rig: Rig) -> None:
    after(rig, 2)
    rig.watch.is_urgent()
    assert not rig.watch.is_urgent()
    rig.failing = True
    rig._message(Stream.STROKES)
    assert rig.watch.is_urgent()
    status = rig.second()["model"]
    assert (status.level, status.message) == (Level.ERROR, "the sweep found a singular pivot")
    assert status.values["failures"] == 101
    assert not rig.watch.is_urgent()
    assert after(rig, 2, failing=False)["model"].level == Level.OK


def test_strokes_that_give_no_prediction_are_an_error_with_what_is_wrong_with_them(rig: Rig, monkeypatch: Any) -> None:
    def refused(stream: Stream, stamp: int) -> Report:
        return Report(stamp, True, events=("leap",))

    def look(leaps: int) -> Status:
        for _ in range(100):
            rig.now += 0.01
            rig._message(Stream.STROKES)
        words = {"leap": "far from where it was", "late": "late"}
        counts = {"scene": "s", "samples: leap": leaps, "samples: late": 7}
        return rig.watch.look(counts, "", rig.peers, [], rig.now + 1e9, words=words)[0]

    after(rig, 2)
    assert look(3).level == Level.OK
    monkeypatch.setattr(rig, "_report", refused)
    found = [look(3 + 100 * k) for k in range(1, 5)]
    assert found[0].level == Level.OK and found[-1].level == Level.ERROR
    assert found[-1].message == "no prediction, although strokes arrive: leap (far from where it was)"
    assert found[-1].values["no_prediction_s"] == pytest.approx(4.0)
    monkeypatch.undo()
    assert look(403).level == Level.OK


def test_a_model_that_is_too_slow_and_clocks_that_differ(rig: Rig) -> None:
    rig.behind[Stream.ANGLES] = 0.08
    found = after(rig, 4, took=0.004)
    assert found["model"].level == Level.WARN and found["model"].values["load"] == pytest.approx(0.8)
    angles = found["joint_angles"]
    assert angles.level == Level.WARN and "stamped behind the strokes" in angles.message
    assert angles.values["clock_offset_s"] == pytest.approx(0.08) and angles.values["clock_offset_s_warn"] == 0.05


def test_the_sources_of_pressures_are_watched_by_the_forces_that_they_give(rig: Rig) -> None:
    rig.second((Stream.STROKES, Stream.ANGLES, Stream.FORCES))
    rig.peers[Stream.PRESSURES] = Peers("/cylinder_pressures", ("/valves", "/bridge"))
    found = rig.watch.look({}, "", rig.peers, [Peers("/out", ("/screen",))], rig.now + 1e9, {})
    (status,) = (each for each in found if each.name == "publishers")
    values = dict(status.values)
    assert status.level is Level.ERROR and "several publishers of /cylinder_pressures: /valves, /bridge" in status.message
    assert values["/cylinder_pressures newest_stamp_s"] == values["/cylinder_forces newest_stamp_s"]
