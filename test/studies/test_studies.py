"""The studies of the documentation: low speed, digits lost to round-off, and the reports."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from default_boom import motion_of, posture_angles
from studies.__main__ import main
from studies.papers import low_speed
from studies.roundoff.exact_step import digits, one_step

from boom_twin import load_scene
from boom_twin.validation.study.scenes import long_boom

SCENE = load_scene()


def test_leaving_velocity_terms_out_errs_with_the_square_of_the_speed() -> None:
    speeds = low_speed.error_by_speed(SCENE, motion_of(SCENE), (6.0, 3.0), 5e-3)
    slopes = np.log(speeds[1, 1:] / speeds[0, 1:]) / np.log(speeds[1, 0] / speeds[0, 0])
    assert slopes == pytest.approx([2.0, 2.0], abs=0.15)
    assert 5e-4 < speeds[1, 1] < 2e-3  # m


def test_plain_product_loses_digits_with_the_length_and_riccati_does_not():
    steps = [one_step(boom, posture_angles(boom, "test"), 1e-3, 0.8) for boom in map(long_boom, (2, 3, 5, 20))]
    plain, riccati = ([digits(getattr(step, name)) for step in steps] for name in ("plain", "riccati"))
    assert np.all(np.diff(plain) > 0.5) and plain[-1] > 15.0
    assert max(riccati) < 2.5
    assert max(step.exact for step in steps) < 1e-15
    usual = one_step(SCENE, motion_of(SCENE).angles, 1e-3, 0.8)
    assert digits(usual.plain) > 8.0 and digits(usual.riccati) < 1.0


DOCS = Path(__file__).parents[2] / "docs" / "study"
FILES = {
    "papers": ("papers_low_speed.png",),
    "clearance": ("clearance.png", "clearance_static.png"),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", FILES)
def test_a_report_has_the_chapters_of_the_page_in_the_docs(kind: str, tmp_path: Path) -> None:
    pytest.importorskip("exudyn")
    main([kind, "--quick", "--out", str(tmp_path / "out")])
    assert {path.name for path in (tmp_path / "out").iterdir()} == {f"{kind}.md", *FILES[kind]}
    made, kept = (path.read_text(encoding="utf-8") for path in (tmp_path / "out" / f"{kind}.md", DOCS / f"{kind}.md"))
    assert re.findall(r"^#.*", made, re.MULTILINE) == re.findall(r"^#.*", kept, re.MULTILINE)
    assert "nan" not in made and "surrogates" in made
