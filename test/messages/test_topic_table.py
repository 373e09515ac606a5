"""The table of topics."""

from __future__ import annotations

from ros_messages import Output, load_topics

from boom_twin import Stream


def test_defaults_are_those_of_the_interface() -> None:
    topics = load_topics()
    assert {role: topic.name for role, topic in topics.inputs.items()} == {
        Stream.STROKES: "cylinder_strokes",
        Stream.ANGLES: "joint_angles",
        Stream.IMU: "tip_imu",
        Stream.FORCES: "cylinder_forces",
        Stream.PRESSURES: "cylinder_pressures",
    }
    assert {role: topic.absolute for role, topic in topics.outputs.items()} == {
        Output.TIP_DISPLACEMENT: "/boom_twin/tip/displacement",
        Output.TIP_POSITION: "/boom_twin/tip/position",
        Output.TIP_ACCELERATION: "/boom_twin/tip/acceleration",
        Output.JOINT_STATES: "/boom_twin/joint_states",
        Output.RESIDUALS: "/boom_twin/residuals",
        Output.SHAPE: "/boom_twin/shape",
        Output.CHANGES: "/boom_twin/changes",
        Output.HEALTH: "/boom_twin/health",
        Output.TIP_UNCERTAINTY: "/boom_twin/tip/uncertainty",
        Output.ESTIMATE_POSE: "/boom_twin/estimate/tip/pose",
        Output.ESTIMATE_TWIST: "/boom_twin/estimate/tip/twist",
        Output.ESTIMATE_ACCELERATION: "/boom_twin/estimate/tip/acceleration",
        Output.ESTIMATE_LOAD: "/boom_twin/estimate/tip/load",
        Output.ESTIMATE_MODES: "/boom_twin/estimate/modes",
        Output.DIAGNOSTICS: "/diagnostics",
    }
    assert topics.inputs[Stream.IMU].absolute == "/tip_imu"
    assert [topic.required for topic in topics.inputs.values()] == [True, True, False, False, False]
    assert {topic.qos.reliability for topic in topics.inputs.values()} == {"best_effort"}
    assert not topics.sensors and topics.mounts(3) == [None] * 3 and not topics.is_shared
