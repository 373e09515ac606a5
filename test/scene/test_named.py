"""Parameters by name: read, changed, refused."""

from __future__ import annotations

import pytest

from boom_twin import load_scene, statics
from boom_twin.errors import UsageError
from boom_twin.scene.edit import parameter, parameter_names, with_parameters

SCENE = load_scene()


@pytest.mark.parametrize("name", parameter_names(SCENE))
def test_what_is_set_is_read_and_nothing_else_changes(name: str) -> None:
    value = 1.3 * parameter(SCENE, name) + {"tip.payload": 5.0, "line_fill": 5.0, "base.inclination": -0.1}.get(name, 0.0)
    other = with_parameters(SCENE, {name: value})
    assert parameter(other, name) == pytest.approx(value, rel=1e-12)
    for same in set(parameter_names(SCENE)) - {name}:
        assert parameter(other, same) == parameter(SCENE, same)


def test_section_masses_are_all_that_the_cylinders_carry_beside_links_and_themselves() -> None:
    bare = SCENE
    joints = [joint.model_copy(update={"mL": None, "mR": None}) for joint in bare.joints]
    cylinders = [joint.cylinder.model_copy(update={"barrel": None, "rod": None}) for joint in joints]
    joints = [joint.model_copy(update={"cylinder": each}) for joint, each in zip(joints, cylinders, strict=True)]
    bare = bare.model_copy(update={"joints": tuple(joints)})
    heavy = with_parameters(bare, {f"section_{i}.mass": 1.001 * parameter(bare, f"section_{i}.mass") for i in (1, 2, 3, 4)})
    light, loaded = statics(bare, posture="horizontal"), statics(heavy, posture="horizontal")
    assert loaded.cylinder_forces == pytest.approx(1.001 * light.cylinder_forces, rel=1e-4)


@pytest.mark.parametrize("name", ["cylinder_9.k", "cylinder_1.EI", "section_0.EI", "payload", "section_1.k"])
def test_unknown_names_are_refused_with_the_known_ones(name: str) -> None:
    with pytest.raises(UsageError, match=r"no such parameter.*tip\.payload"):
        parameter(SCENE, name)


@pytest.mark.parametrize(
    ("name", "value"),
    [("cylinder_1.k", 0.0), ("tip.payload", -1.0), ("section_2.EI", float("inf")), ("base.inclination", float("nan"))],
)
def test_values_that_no_scene_may_have(name: str, value: float) -> None:
    with pytest.raises(UsageError, match="must be finite"):
        with_parameters(SCENE, {name: value})
