"""A scene file that was cut off is refused, or told; never read as if it were whole."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import Any

import pytest
from command import main
from default_boom import clearance_text, default_text, examine

from boom_twin import SceneError, SceneWarning, load_scene


def silent_cuts(bench: Any, text: str, places: Iterable[int]) -> list[int]:
    """Return where the text can be cut so that it loads as another scene without a fault or a warning."""
    whole, found = examine(bench.text(text))[0], []
    for place in places:
        bench.path.write_bytes(text.encode()[:place])
        try:
            scene, oddities = examine(bench.path)
        except SceneError as error:
            assert error.faults
        else:
            if scene != whole and not oddities:
                found.append(place)
    return found


@pytest.mark.parametrize("given", [(), ("--clearance",)], ids=["default", "clearance"])
@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["ends of lines", "every byte"])
def test_no_cut_of_a_printed_scene_goes_by(
    bench: Any, capsys: pytest.CaptureFixture[str], given: tuple[str, ...], every: bool
) -> None:
    """Cut at ends of lines, where YAML is most likely to be whole, and around the mark and the promise of it."""
    assert main(["scene", *given]) == 0
    text = capsys.readouterr().out.encode()
    ends = [place for place, byte in enumerate(text) if byte == ord("\n")]
    places = {end + more for end in ends for more in (0, 1)} | set(range(ends[1])) | set(range(ends[-4], len(text)))
    assert silent_cuts(bench, text.decode(), range(len(text)) if every else sorted(places - {len(text)})) == []


def test_cuts_of_a_scene_without_the_mark_are_told(bench: Any) -> None:
    text = "\n".join(line for line in default_text().splitlines() if "end of scene" not in line) + "\n"
    with pytest.warns(SceneWarning, match="end of the file"):
        assert load_scene(bench.text(text)) == load_scene()
    assert silent_cuts(bench, text, range(text.index("postures:"), len(text) - 1, 7)) == []
    text = default_text()
    (fault,) = bench.faults_of(bench.text(text[: text.index("  high:")]))
    assert fault.path == "end of the file" and "cut off" in fault.bound and "Fetch the whole file" in fault.remedy


def test_a_block_behind_the_mark_is_read_and_told_and_blanks_do_not_matter(bench: Any) -> None:
    scene, oddities = examine(bench.text(default_text() + "\n" + clearance_text()))
    assert scene.clearance is not None and [oddity.path for oddity in oddities] == ["end of the file"]
    bench.path.write_bytes((default_text() + "\n  \n").replace("\n", "\r\n").encode())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load_scene(bench.path) == load_scene()
