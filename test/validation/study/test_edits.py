"""Edits of scenes and of their text say the same, and leave everything else as it was."""

from __future__ import annotations

import difflib
import io
from pathlib import Path

import pytest
from default_boom import default_text, examine, examine_text, with_end_mark
from ruamel.yaml import YAML

from boom_twin import Scene, load_scene
from boom_twin.reduction.search import KINDS, variants
from boom_twin.scene.edit import Edit, edited, rewritten

EDITS = (
    Edit(("modes",), 4),
    Edit(("sections", 0, "modes"), 2),
    Edit(("sections", 0, "rho_I"), None),
    Edit(("joints", 1, "mL"), None),
    Edit(("joints", 1, "mR"), None),
    Edit(("joints", 0, "cylinder", "k"), None),
    Edit(("joints", 0, "cylinder", "d"), None),
    Edit(("joints", 2, "cylinder", "barrel"), None),
    Edit(("joints", 3, "cylinder", "rod"), None),
)


def scene_of(text: str) -> Scene:
    return examine_text(text, "test", whole=True)[0]


def in_blocks(text: str) -> str:
    """The same scene without braces and brackets."""
    yaml, stream = YAML(), io.StringIO()
    yaml.default_flow_style = False
    yaml.dump(YAML(typ="safe").load(text), stream)
    return stream.getvalue()


def changes(before: str, after: str) -> list[str]:
    """Lines that went or came."""
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), n=0, lineterm="")
    return [line for line in lines if line[0] in "+-" and not line.startswith(("---", "+++"))]


@pytest.mark.parametrize("form", [str, in_blocks], ids=["braces", "blocks"])
def test_the_edited_text_describes_the_edited_scene(form, tmp_path: Path) -> None:
    text = with_end_mark(form(default_text()))
    scene = scene_of(text)
    after = with_end_mark(rewritten(text, scene, edited(scene, EDITS)))
    (tmp_path / "lean.yaml").write_text(after, encoding="utf-8")
    found, oddities = examine(tmp_path / "lean.yaml")
    lean = edited(scene, EDITS)
    assert found.model_dump() == lean.model_dump() and oddities == []
    assert lean.modes == 4 and lean.sections[0].rho_I is None and lean.joints[0].cylinder.k is None
    assert lean.sections[1:] == scene.sections[1:] and scene == scene_of(text)


def test_comments_and_layout_stay() -> None:
    text = default_text()
    one = rewritten(text, load_scene(), edited(load_scene(), [Edit(("sections", 3, "modes"), 1)]))
    comments = [line.partition("#")[2] for line in text.splitlines() if "#" in line]
    assert [line.partition("#")[2] for line in one.splitlines() if "#" in line] == comments and "modes: 1}" in one
    assert "A: 2.20e-3" in one  # numbers that did not change stay as they were written
    blocks = in_blocks(text).replace("    mass: 36.0", "    mass: 36.0  # heavy")
    after = rewritten(blocks, scene_of(blocks), edited(scene_of(blocks), EDITS[3:5]))
    assert changes(blocks, after) == ["-  mL: 4.0", "-  mR: 3.0"] and "# heavy" in after


@pytest.mark.parametrize("one_of_a_kind", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_every_variant_of_the_default_scene_is_a_scene(tmp_path: Path, one_of_a_kind: bool) -> None:
    scene, text, path = load_scene(), default_text(), tmp_path / "variant.yaml"
    found = variants(scene)
    assert len({variant.name for variant in found}) == len(found) > 40
    kinds = {variant.kind: variant for variant in found}
    assert len(kinds) == len(KINDS) + 1  # numbers of shapes
    for variant in kinds.values() if one_of_a_kind else found:
        path.write_text(with_end_mark(rewritten(text, scene, variant.of(scene))), encoding="utf-8")
        assert examine(path)[0].model_dump() == variant.of(scene).model_dump() != scene.model_dump(), variant.name
