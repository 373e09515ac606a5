"""The HTML report and its figures."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from command import main
from health.recorded import written
from page_outline import outline

from boom_twin import BagError
from boom_twin.report.quantities import FREQUENCY_ERROR, BatchMeans, read
from boom_twin.scene.load import default_text
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


def test_heights_of_the_scene_are_taken(tmp_path: Path) -> None:
    text = default_text().replace("- {length:", "- {height: 0.3, length:")
    (tmp_path / "boom.yaml").write_text(text, encoding="utf-8")
    given, out = ["--scene", str(tmp_path / "boom.yaml")], tmp_path / "out"
    written(tmp_path / "bag", 3.0)
    assert main(["replay", str(tmp_path / "bag"), "--out", str(out), "--report", "--no-health", *given]) == 0
    found = outline(out / "report.html").text
    assert "Heights as in the scene." in found and "The rig's health was not judged." in found


def test_batch_means_are_as_sure_as_they_say() -> None:
    random, pairs = np.random.default_rng(0), np.empty((200, 2))
    for pair in pairs:
        means = BatchMeans()
        means.add(random.normal(3.0, 2.0, 500))
        pair[:] = means.mean
    assert pairs[:, 0].std() == pytest.approx(2.0 / np.sqrt(500), rel=0.2)
    assert pairs[:, 1].mean() == pytest.approx(2.0 / np.sqrt(500), rel=0.2)


@pytest.mark.parametrize("text", [None, "{", "[]", '{"scene_sha256": "1"}', '{"scene_sha256": "1", "quantities": [{"x": 1}]}'])
def test_a_folder_without_figures(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / "quantities.json").write_text(text)
    with pytest.raises(BagError, match=r"quantities\.json: .*Replay the session again"):
        read(tmp_path)


def test_figures_of_a_replay(replays: tuple[Path, Path]) -> None:
    healthy, faulty = ({each.name: each for each in read(folder)[1]} for folder in replays)
    assert healthy.keys() == faulty.keys()
    assert abs(healthy["residual_mean_joint_3"].value) < 5e-5
    assert faulty["residual_mean_joint_3"].value == pytest.approx(0.0035 * 0.5, rel=0.05)
    ratio = healthy["frequency_ratio_mode_1"]
    assert ratio.sigma == pytest.approx(FREQUENCY_ERROR, rel=0.1) and abs(ratio.value - 1.0) < 2e-3
    assert 0.005 < healthy["damping_mode_1"].value < 0.012
    assert healthy["bending_moment_max_section_1"].value > healthy["bending_moment_max_section_4"].value > 100.0
