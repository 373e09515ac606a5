"""Scenes from paths, dicts and changes; short texts of results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drive_twin import drive_twin
from ruamel.yaml import YAML

from boom_twin import load_scene, simulate, statics
from boom_twin.errors import SceneError, UsageError
from boom_twin.scene.load import default_text

DOCUMENT: dict[str, Any] = YAML(typ="safe").load(default_text())


def test_a_path_a_dict_and_nothing_are_scenes(tmp_path: Path) -> None:
    path = tmp_path / "boom.yaml"
    path.write_text(default_text())
    found = [statics(source, "arch").tip for source in (path, str(path), DOCUMENT, None, load_scene(DOCUMENT))]
    assert all(np.array_equal(tip, found[0]) for tip in found)
    assert drive_twin(str(path)).scene == drive_twin(DOCUMENT).scene == load_scene()
    rest = statics(DOCUMENT, "arch")
    assert statics(DOCUMENT, rest.strokes.tolist()).tip == pytest.approx(rest.tip, abs=1e-9)
    motion = simulate(DOCUMENT, [0.0, 0.1], [rest.strokes, rest.strokes], estimate_errors=False)
    assert motion.tip[-1, :2] == pytest.approx(rest.tip, abs=1e-6)


def test_values_of_numpy_are_numbers() -> None:
    assert load_scene() == load_scene({**DOCUMENT, "modes": np.int64(DOCUMENT.get("modes", 3))})


def test_a_dict_is_checked_as_a_file_is() -> None:
    with pytest.raises(SceneError, match="unknown key"):
        statics({**DOCUMENT, "gravitty": [0, -9.81]}, "arch")
    with pytest.raises(UsageError, match="give a Scene, the path"):
        statics(3, "arch")  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="not both"):
        statics(DOCUMENT, "arch", posture="arch")


def test_changes_are_validated_and_the_scene_stays() -> None:
    scene = load_scene()
    heavy = scene.with_(payload=40, line_fill=10.0)
    assert heavy.tip is not None and heavy.tip.payload == 40.0 and heavy.line_fill == 10.0
    assert scene == load_scene() and heavy.with_(payload=None).tip != heavy.tip
    assert scene.with_({"cylinder_2.k": 1e7}).joints[1].cylinder.k == 1e7
    with pytest.raises(SceneError, match=r"tip\.payload = -4\.0: it must not be less than 0"):
        scene.with_(payload=-4)
    with pytest.raises(SceneError, match="modes"):
        scene.with_(modes=99)
    with pytest.raises(UsageError, match="The nearest is payload"):
        scene.with_(paylaod=40)


def test_texts_of_results_are_short_and_say_what_matters() -> None:
    rest = statics(None, "arch")
    assert "\n" not in repr(rest) and len(repr(rest)) < 300 and "frequencies 1.06" in repr(rest) and str(rest) == repr(rest)
    table = rest._repr_html_()
    assert table.startswith("<table>") and "<th>tip</th><td>8.188, -0.4401 m</td>" in table
    assert repr(load_scene()).startswith("Scene(sections 4, 3.86, 3.3, 3.2, 3.1 m")
    assert "arch<" not in load_scene().with_(description="<b>arch</b>")._repr_html_()
    assert len(repr(drive_twin())) < 400


def test_motions_are_frames_too() -> None:
    pytest.importorskip("pandas", reason="pip install .[test]")
    rest = statics(None, "arch")
    motion = simulate(None, [0.0, 0.1], [rest.strokes] * 2, estimate_errors=False)
    frame = motion.to_frame()
    assert list(frame.columns) == list(motion.columns()) and frame["tip_x_m"].iloc[-1] == motion.tip[-1, 0]
