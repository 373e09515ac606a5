"""The report page: complete, self-contained, well-formed, and right about a faulty session."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from command import main
from health.recorded import written
from page_outline import outline

from boom_twin.texts import alarm_text

SESSION = str(Path(__file__).parents[2] / "bags" / "arch_session")
TITLES = (
    "Alarms over time",
    "Residuals",
    "Natural frequencies and damping",
    "Tip",
    "Bending of the sections",
    "Gaps and events",
)


def test_the_page_has_every_part_and_needs_nothing_but_itself(replays: tuple[Path, Path]) -> None:
    for folder in replays:
        found, text = outline(folder / "report.html"), (folder / "report.html").read_text(encoding="utf-8")
        assert len(found.sources) >= 6 and all(source.startswith("data:image/png;base64,") for source in found.sources)
        assert "script" not in found.tags and "link" not in found.tags
        assert "url(" not in text and "@import" not in text and "http" not in re.sub('base64,[^"]*', "", text)
        assert all(f"<h2>{title}</h2>" in text for title in TITLES)
        assert "synthetic session &lt;of a test&gt; &amp; more" in text and "<of a test>" not in text
        assert "load at the tip that the model does not know" in found.text and "Estimated: by all sensors" in found.text


def test_a_fault_is_named_with_its_time(replays: tuple[Path, Path]) -> None:
    healthy, faulty = (outline(folder / "report.html").text for folder in replays)
    assert "No alarm: no sensor gives itself away" in healthy and "Heights are not in the scene: assumed are 2.4" in healthy
    first_lines = faulty.partition("synthetic session")[0]
    assert alarm_text("joint_3", "jump", "joint_3.sensor") in first_lines and "Largest bending stresses: section" in first_lines
    assert first_lines.count(" MPa at ") == 3 and "Hours a year that use it up" in first_lines
    assert "1 alarm." in faulty and "joint_3: joint_3.sensor" in faulty
    assert alarm_text("joint_3", "jump", "joint_3.sensor") in faulty
    began = re.search(r"from ([0-9.]+) s, it lasts to the end", faulty)
    assert began is not None and float(began[1]) == pytest.approx(12.0, abs=1.0)


def test_heights_may_be_given(tmp_path: Path) -> None:
    heights, out = ["--section-height", "0.4,0.3,0.2,0.1"], tmp_path / "out"
    written(tmp_path / "bag", 3.0)
    assert main(["replay", str(tmp_path / "bag"), "--out", str(out), "--report", "--no-health", *heights]) == 0
    text = outline(out / "report.html").text
    assert "Heights as given." in text and "The rig's health was not judged." in text


@pytest.mark.parametrize("heights", ["0.4,0.3", "a,b,c,d", "0.4,0.3,0.2,0.0", "0.4,0.3,0.2,nan", ""])
def test_heights_that_are_none(heights: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", SESSION, "--out", str(tmp_path), "--report", f"--section-height={heights}"]) == 1
    assert "give 4 heights above 0, in m" in capsys.readouterr().err
