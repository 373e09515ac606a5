"""The study of a scene's parts: complete, sorted, and the same as editing the file by hand."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from boom_twin import Scene, statics
from boom_twin.reduction import deviation
from boom_twin.reduction.variants import variants
from boom_twin.validation.study import parts


@pytest.fixture(scope="module")
def found(two_sections: Scene) -> parts.PartsStudy:
    return parts.measure(two_sections, deviation.course_of(two_sections), rounds=1)


def test_every_variant_is_there_ascending_in_error(found: parts.PartsStudy, two_sections: Scene) -> None:
    assert {part.variant for part in found.parts} == set(variants(two_sections))
    errors = [part.deviation.worst for part in found.parts]
    assert errors == sorted(errors) and all(np.isfinite(errors))
    assert all(part.status == "ok" for part in found.parts)
    assert all(part.step_time > 0.0 for part in found.parts)


def test_its_numbers_are_those_of_the_edited_scene(found: parts.PartsStudy, two_sections: Scene) -> None:
    part = next(part for part in found.parts if part.variant.name == "cylinder 2 incompressible")
    second = two_sections.joints[1]
    cylinder = second.cylinder.model_copy(update={"k": None, "d": None})
    hard = two_sections.model_copy(
        update={"joints": (two_sections.joints[0], second.model_copy(update={"cylinder": cylinder}))}
    )
    full, lean = (statics(scene, posture="arch", modes=3) for scene in (two_sections, hard))
    assert part.shifts == pytest.approx(lean.frequencies / full.frequencies - 1.0, abs=1e-6)
    off = [np.linalg.norm(statics(two_sections, posture=n).tip - statics(hard, posture=n).tip) for n in ("arch", "low")]
    assert part.deviation.rest == pytest.approx(max(off), rel=1e-6)
    assert part.unknowns == found.unknowns


def test_the_files(found: parts.PartsStudy, two_sections: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "measure", lambda *_: found)
    out = tmp_path / "deep" / "out"
    written = parts.write(two_sections, out, quick=True)
    assert sorted(written) == sorted(out.iterdir())
    values = json.loads((out / "parts.json").read_text())
    assert len(values["variants"]) == len(found.parts) and values["machine"]["cpu"]
    first = values["variants"][0]
    assert first["edits"].startswith(("sections[", "remove ")) and first["step_time_s"] > 0.0
    text = (out / "parts.md").read_text()
    assert (
        text.count("\n| ") == len(found.shown) + 1 and "Leave out parts whose error you accept" in text and "surrogate" in text
    )
    assert (out / "parts.png").read_bytes()[:4] == b"\x89PNG"
