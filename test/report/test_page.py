"""The page: complete, self-contained, well-formed, and right about a faulty session."""

from __future__ import annotations

import re
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import pytest
from health.recorded import written

from boom_twin.cli.main import main

VOID = {"meta", "img", "br"}


class Outline(HTMLParser):
    """Tags that are open, sources of pictures, headlines, text."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.sources: list[str] = []
        self.tags: set[str] = set()
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list) -> None:
        self.tags.add(tag)
        self.sources += [value for name, value in attrs if name in ("src", "href", "srcset")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def outline(folder: Path) -> Outline:
    found = Outline()
    found.feed((folder / "report.html").read_text(encoding="utf-8"))
    assert found.open == []
    return found


def test_the_page_needs_nothing_but_itself(replays: tuple[Path, Path]) -> None:
    for folder in replays:
        found, text = outline(folder), (folder / "report.html").read_text(encoding="utf-8")
        assert len(found.sources) >= 6 and all(source.startswith("data:image/png;base64,") for source in found.sources)
        assert "script" not in found.tags and "link" not in found.tags
        assert "url(" not in text and "@import" not in text and "http" not in re.sub('base64,[^"]*', "", text)


@pytest.mark.parametrize(
    "title",
    ["Alarms", "Residuals", "Natural frequencies and damping", "Tip", "Bending of the sections", "Gaps and events"],
)
def test_every_part_is_there(replays: tuple[Path, Path], title: str) -> None:
    for folder in replays:
        assert f"<h2>{title}</h2>" in (folder / "report.html").read_text(encoding="utf-8")


def test_the_estimate_and_the_load_are_told(replays: tuple[Path, Path]) -> None:
    for folder in replays:
        text = outline(folder).text
        assert "load at the tip that the model does not know" in text and "Estimated: by all sensors together" in text


def test_where_the_session_comes_from_is_said_and_escaped(replays: tuple[Path, Path]) -> None:
    text = (replays[0] / "report.html").read_text(encoding="utf-8")
    assert "synthetic session &lt;of a test&gt; &amp; more" in text and "<of a test>" not in text
    assert "<of a test>" in unescape(text)


def test_a_fault_is_named_with_its_time(replays: tuple[Path, Path]) -> None:
    healthy, faulty = (outline(folder).text for folder in replays)
    assert "No alarm: no sensor gives itself away" in healthy
    assert "1 alarm of the rig's health." in faulty and "joint_3: joint_3.sensor" in faulty
    began = re.search(r"From ([0-9.]+) s, lasts to the end", faulty)
    assert began is not None and float(began[1]) == pytest.approx(12.0, abs=1.0)


def test_the_scene_of_a_twin_has_stresses_by_assumed_heights(replays: tuple[Path, Path]) -> None:
    assert "Heights are not in the scene: assumed are 2.4 radii" in outline(replays[0]).text


def test_heights_may_be_given(tmp_path: Path) -> None:
    heights, out = ["--section-height", "0.4,0.3,0.2,0.1"], tmp_path / "out"
    written(tmp_path / "bag", 3.0)
    assert main(["replay", str(tmp_path / "bag"), "--out", str(out), "--report", "--no-health", *heights]) == 0
    text = outline(out).text
    assert "Heights as given." in text and "The rig's health was not judged." in text


@pytest.mark.parametrize("heights", ["0.4,0.3", "a,b,c,d", "0.4,0.3,0.2,0.0", "0.4,0.3,0.2,nan", ""])
def test_heights_that_are_none(heights: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", "nowhere", "--out", str(tmp_path), "--report", f"--section-height={heights}"]) == 1
    assert "give 4 heights above 0, in m" in capsys.readouterr().err


def test_the_report_needs_its_pictures(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["replay", "nowhere", "--out", str(tmp_path), "--report", "--no-pictures"])
