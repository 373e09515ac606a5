"""Made-up booms of many sections: they are valid scenes."""

from __future__ import annotations

import json

import pytest
from default_boom import examine, with_end_mark

from boom_twin.validation.study.long_booms import long_boom


@pytest.mark.parametrize("count", [2, 3, 7, 50, pytest.param(200, marks=pytest.mark.slow)])  # 200: four times 50
def test_a_long_boom_passes_as_a_scene_file(count, tmp_path):
    check(long_boom(count, kinds=("B1", "B2", "B3")), tmp_path)


def check(scene, folder):
    file = folder / "boom.yaml"
    file.write_text(with_end_mark(json.dumps(scene.model_dump(exclude_none=True, mode="json"))))
    loaded, _ = examine(file)  # which warns of stiffnesses and boxes that nobody would build
    assert loaded == scene
