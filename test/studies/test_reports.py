"""The scripts that make the documentation's reports of the papers, of play in the pins and of round-off."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from studies.__main__ import main

DOCS = Path(__file__).parents[2] / "docs" / "study"
FILES = {
    "papers": ("papers_low_speed.png",),
    "clearance": ("clearance.png", "clearance_static.png"),
    "roundoff": ("roundoff.png",),
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
