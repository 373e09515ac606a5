"""Settings of a replay: those of the node that was recorded, or of a parameter file as rclpy resolves it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from default_boom import strokes_of_posture
from recordings import SESSION_YAML as FILE_NAME
from recordings import SessionMetadata, write_session

from boom_twin import BagError, Settings, UsageError, load_scene, replay
from boom_twin.bag.session_model import settings_of
from boom_twin.cli.output import open_session_settings
from boom_twin.cli.replay import as_text
from boom_twin.config.settings import Thresholds, load_thresholds

BUNDLED = Path(__file__).parents[2] / "bags" / "arch_session"


def test_the_parameters_are_those_of_the_node_that_was_recorded(tmp_path, capsys):
    """A replay with others was another one, without a word."""
    assert settings_of(BUNDLED).settings == Settings()
    SessionMetadata("0", twin={"imu_sigma": 0.2, "payload": 30.0, "scene": "", "autostart": True}).write(tmp_path)
    found = settings_of(tmp_path)
    assert (found.settings, found.source) == (Settings(imu_sigma=0.2, payload=30.0), f"{tmp_path / FILE_NAME}, twin")
    assert open_session_settings(tmp_path, None) == found.settings
    assert f"parameters: {tmp_path / FILE_NAME}, twin: imu_sigma 0.2, payload 30" in capsys.readouterr().err
    given = tmp_path / "given.yaml"
    given.write_text("/**:\n  ros__parameters:\n    imu_sigma: 0.1\n", encoding="utf-8")
    assert settings_of(tmp_path, given).settings == Settings(imu_sigma=0.1)
    for wrong in ({"imu_sigma": -1.0}, {"stroke_rate": -1.0}, {"gap": "a while"}):
        SessionMetadata("0", twin=wrong).write(tmp_path)
        with pytest.raises(BagError, match=rf"session\.yaml, twin: {next(iter(wrong))} .*--params"):
            settings_of(tmp_path)


@pytest.mark.parametrize(("step", "told"), [(1e-3, True), (1e-6, False)])
def test_coarse_readings_are_told_once_with_the_setting_that_says_so(tmp_path: Path, step: float, told: bool) -> None:
    """Sensors that are read out in steps of 1 mm, as often on CAN, had dozens of alarms that did not name the setting."""
    stamps, strokes = 5_000_000 * np.arange(1, 801), np.tile(strokes_of_posture(load_scene(), "arch"), (800, 1))
    strokes += 0.01 * (1.0 - np.cos(np.pi * 1e-9 * stamps))[:, None] + np.random.default_rng(0).normal(0.0, 2e-5, (800, 4))
    write_session(tmp_path / "bag", stamps, step * np.round(strokes / step), None, None, {"origin": "synthetic, a test"})
    summary = replay(tmp_path / "bag", None, tmp_path / "out", with_bag=False).summary
    lines = [line for line in as_text(summary) if "readings come in steps" in line]
    assert len(lines) == told and (not told or "of 0.001 m: set stroke_resolution" in lines[0])
    settings = Settings(stroke_resolution=step)
    assert "read_out" not in replay(tmp_path / "bag", None, tmp_path / "set", settings=settings, with_bag=False).summary


BLOCKS = {
    "beside those of all nodes": ("/**: {ros__parameters: {gap: 0.2}}\nboom_twin: {ros__parameters: {payload: 40.0}}", ""),
    "last one wins": ("boom_twin: {ros__parameters: {payload: 1.0}}\n/**: {ros__parameters: {gap: 0.2, payload: 40.0}}", ""),
    "behind another node": (
        "other: {ros__parameters: {payload: 1.0}}\n/boom_twin: {ros__parameters: {payload: 40.0, gap: 0.2}}",
        "",
    ),
    "below a namespace": ("front: {boom_twin: {ros__parameters: {payload: 40.0, gap: 0.2}}}", "front"),
    "wildcard of one part": (
        "/*/boom_twin: {ros__parameters: {payload: 40.0, gap: 0.2}}\n/*: {ros__parameters: {gap: 3.0}}",
        "/front/",
    ),
    "wildcard of parts": (
        "/a/**/boom_twin: {ros__parameters: {payload: 40.0}}\n/**: {boom_twin: {ros__parameters: {gap: 0.2}}}",
        "a/b",
    ),
    "of rclpy itself": (
        "/**: {ros__parameters: {use_sim_time: true, start_type_description_service: false, gap: 0.2, payload: 40.0,"
        " qos_overrides: {/tip_imu: {subscription: {depth: 3}}}, scene: other.yaml}}",
        "",
    ),
}


@pytest.mark.parametrize("kind", BLOCKS)
def test_a_parameter_file_is_resolved_as_by_the_node(kind, tmp_path):
    """What rclpy 7.1.6 gives a node of that name and namespace."""
    given, (text, namespace) = tmp_path / "given.yaml", BLOCKS[kind]
    given.write_text(text, encoding="utf-8")
    assert settings_of(BUNDLED, given, namespace).settings == Settings(gap=0.2, payload=40.0)
    assert load_thresholds(given, namespace) == Thresholds()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "front: {boom_twin: {ros__parameters: {payload: 40.0}}}",
            r"no parameters of /boom_twin, only of /front/boom_twin\. Name",
        ),
        ("boom_twin: {ros__parameters: [payload]}", "not a ROS parameter file"),
        ("boom_twin: {ros__parameters: {pay: {load: 40.0}}}", r"pay\.load = 40\.0: unknown\. The nearest is `payload`"),
    ],
)
def test_a_parameter_file_without_any_for_the_twin_is_refused(text, told, tmp_path):
    (given := tmp_path / "given.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(UsageError, match=told):
        settings_of(BUNDLED, given)
