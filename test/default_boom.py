"""Texts of the package's scenes, postures and moves as strokes and angles, other parameters, settings of an exact scene."""

from __future__ import annotations

from boom_twin import Settings
from boom_twin.analysis.methods import motion_of
from boom_twin.scene.edit import anew, loaded, parameter, parameter_names, with_parameters, with_rigid_cylinders
from boom_twin.scene.kinematics import (
    joint_angles_of_strokes,
    posture_angles,
    skeleton,
    stroke_curve,
    strokes_of_angles,
    strokes_of_posture,
)
from boom_twin.scene.load import clearance_text, default_text, examine, examine_text, example_names, example_text, with_end_mark

__all__ = [
    "EXACT", "anew", "clearance_text", "default_text", "examine", "examine_text", "example_names", "example_text",
    "joint_angles_of_strokes", "loaded", "motion_of", "parameter", "parameter_names", "posture_angles", "skeleton",
    "stroke_curve", "strokes_of_angles", "strokes_of_posture", "with_end_mark", "with_parameters",
    "with_rigid_cylinders",
]  # fmt: skip

EXACT = Settings(scene_error=0.0)  # the scene has no errors: the stated deviation is that of the sensors alone
