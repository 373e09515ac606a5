"""Scenes from paths, dicts and changes; parameters by name."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from default_boom import default_text, parameter, parameter_names, with_parameters
from drive_twin import drive_twin
from oracle import booms
from scene.editing import DEFAULT

from boom_twin import SceneError, UsageError, load_scene, simulate, statics

SCENE = load_scene()
ELASTIC = booms.on_elastic_base(SCENE, 5.0e6, 5.0e4)


def test_a_path_a_dict_and_nothing_are_scenes(bench: Any) -> None:
    path = bench.text(default_text())
    found = [statics(source, "arch").tip for source in (path, str(path), DEFAULT, None, load_scene(DEFAULT))]
    assert all(np.array_equal(tip, found[0]) for tip in found)
    assert drive_twin(str(path)).scene == drive_twin(DEFAULT).scene == SCENE == load_scene({**DEFAULT, "modes": np.int64(3)})
    rest = statics(DEFAULT, "arch")
    assert statics(DEFAULT, rest.strokes.tolist()).tip == pytest.approx(rest.tip, abs=1e-9)
    motion = simulate(DEFAULT, [0.0, 0.1], [rest.strokes, rest.strokes], estimate_errors=False)
    assert motion.tip[-1, :2] == pytest.approx(rest.tip, abs=1e-6)
    pytest.importorskip("pandas", reason="pip install .[test]")
    frame = motion.to_frame()
    assert list(frame.columns) == list(motion.columns()) and frame["tip_x_m"].iloc[-1] == motion.tip[-1, 0]


def test_a_dict_is_checked_as_a_file_is() -> None:
    with pytest.raises(SceneError, match="unknown key"):
        statics({**DEFAULT, "gravitty": [0, -9.81]}, "arch")
    with pytest.raises(UsageError, match="give a Scene, the path"):
        statics(3, "arch")  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="not both"):
        statics(DEFAULT, "arch", posture="arch")


def test_changes_are_validated_and_the_scene_stays() -> None:
    heavy = SCENE.with_(payload=40, line_fill=10.0)
    assert heavy.tip is not None and heavy.tip.payload == 40.0 and heavy.line_fill == 10.0
    assert load_scene() == SCENE and heavy.with_(payload=None).tip != heavy.tip
    assert SCENE.with_({"cylinder_2.k": 1e7}).joints[1].cylinder.k == 1e7
    with pytest.raises(SceneError, match=r"tip\.payload = -4\.0: it must be greater than or equal to 0"):
        SCENE.with_(payload=-4)
    with pytest.raises(SceneError, match="modes"):
        SCENE.with_(modes=99)
    with pytest.raises(UsageError, match="The nearest is payload"):
        SCENE.with_(paylaod=40)


@pytest.mark.parametrize("name", parameter_names(ELASTIC))
def test_a_parameter_that_is_set_is_read_and_nothing_else_changes(name: str) -> None:
    value = 1.3 * parameter(ELASTIC, name) + {"tip.payload": 5.0, "line_fill": 5.0, "base.inclination": -0.1}.get(name, 0.0)
    other = with_parameters(ELASTIC, {name: value})
    assert parameter(other, name) == pytest.approx(value, rel=1e-12)
    for same in set(parameter_names(ELASTIC)) - {name}:
        assert parameter(other, same) == parameter(ELASTIC, same)


def test_unknown_parameters_and_values_that_no_scene_may_have_are_refused() -> None:
    for name in ("cylinder_9.k", "cylinder_1.EI", "section_0.EI", "payload"):
        with pytest.raises(UsageError, match=r"no such parameter.*tip\.payload"):
            parameter(SCENE, name)
    wrong = {"cylinder_1.k": 0.0, "tip.payload": -1.0, "section_2.EI": np.inf, "base.inclination": np.nan}
    for name, value in wrong.items():
        with pytest.raises(UsageError, match="must be finite"):
            with_parameters(SCENE, {name: value})
