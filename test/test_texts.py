"""Texts that an operator reads: complete in all languages, with the same places for figures."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from math import nan
from pathlib import Path

import pytest

import boom_twin
from boom_twin.health.alarms import change_text, evidence_with_cause
from boom_twin.texts import LANGUAGES, SENTENCES, THINGS, alarm_text, translated, translations
from boom_twin.twin.blocks import event_meaning
from boom_twin.types import SENSORS, StrokeReading

PAGE = Path(boom_twin.__file__).parent / "monitor" / "page"
SIGNS = {"m", "p", "c", "t", "space", "boom twin", "CSV"}
"""Texts of the page that are alike in all languages: keys and names."""


class _Texts(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: set[str] = set()

    def handle_data(self, data: str) -> None:
        if re.search("[A-Za-z]{2}", data) and not re.fullmatch(r"\s*\d+ (s|min)\s*", data):
            self.found.add(data.strip())

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.found |= {value for name, value in attributes if name in ("title", "aria-label") and value}


def texts_of_the_page() -> set[str]:
    parser = _Texts()
    parser.feed((PAGE / "index.html").read_text())
    scripts = "".join(path.read_text() for path in PAGE.glob("*.js") if path.name != "uplot.js")
    called = re.findall(r'\bt\((?:[\w.]+ (?:[=!><-]+ [\w."\d-]+ )*\? )?"((?:[^"\\]|\\.)+)"(?: : "((?:[^"\\]|\\.)+)")?', scripts)
    quoted = {text.replace('\\"', '"') for pair in called for text in pair if text}
    quoted |= set(re.findall(r'"([A-Z][^"]+\.)"', scripts))
    return (parser.found | quoted) - SIGNS


def diagnostics() -> set[str]:
    """Return the constant words of statuses, in the parts that the page looks up."""
    sources = "".join(path.read_text() for path in (Path(boom_twin.__file__).parent / "diagnostics").glob("*_status.py"))
    calls = re.findall(r"(?:judge\.(?:finish|fault|check|check_age)\(|told = )([^\n]+)", sources)
    found = {words for call in calls for words in re.findall(r'"([a-z][^"{}]* [^"{}]*)"', call)}
    return {part for words in found for part in ([words] if words in translations() else re.split("; |: ", words))}


def alarms() -> set[str]:
    parts = {part for sentence in SENTENCES.values() for part in (sentence.what, sentence.remedy)}
    return parts | set(THINGS.values()) | {kind.title for kind in SENSORS.values()}


@pytest.mark.parametrize("source", [texts_of_the_page, diagnostics, alarms])
def test_every_text_is_there_in_all_languages(source: object) -> None:
    wanted = source()  # type: ignore[operator]
    assert len(wanted) > 5 and sorted(wanted - translations().keys()) == []


def test_translations_have_the_places_of_the_english_text() -> None:
    for english, others in translations().items():
        assert len(others) == len(LANGUAGES) - 1 and all(others), english
        for other in others:
            assert sorted(re.findall(r"\{\w+\}", other)) == sorted(re.findall(r"\{\w+\}", english)), english


@pytest.mark.parametrize(
    ("alarm", "begin"),
    [
        (("joint_3", "stuck", "joint_3.sensor"), "Angle sensor of joint 3 repeats one reading"),
        (("tip_imu_x", "stuck", "tip_imu_x.sensor"), "Tip IMU repeats one reading"),
        (("cylinder_2", "softer", "cylinder_2.k"), "Oil spring of cylinder 2 is softer"),
        (("section_1", "softer", "section_1.EI"), "Section 1 is softer"),
        (("cylinder_force_4", "deviation", None), "Force sensor of cylinder 4 does not fit the model"),
        (("{x}", "of another version", None), "{x} does not behave as the model"),
    ],
)
def test_a_sentence_names_the_thing_and_ends_with_what_to_do(alarm: tuple[str, str, str | None], begin: str) -> None:
    assert alarm_text(*alarm).startswith(begin) and alarm_text(*alarm).count(". ") == 1
    assert len({alarm_text(*alarm, language) for language in LANGUAGES}) == len(LANGUAGES)


def test_evidence_is_figures_alone() -> None:
    """So it reads alike in all languages."""
    assert change_text(0.01, "rad", 1e-3) == "+0.573 deg (+- 0.057)" and change_text(-4642.0, "N") == "-4640 N"
    assert evidence_with_cause("+3 kg", [("tip.payload", 0.999), ("unknown", 0.001)]) == "+3 kg; tip.payload 99 %"
    assert evidence_with_cause("+3 kg", [("not known", nan)]) == "+3 kg"
    assert translated("no such text", "de") == "no such text"


def test_a_boom_that_angles_drive_is_told_of_its_angles() -> None:
    assert alarm_text("joint_angles", "gap", None).startswith("Joint angles were missing. Check cable and driver of the angle")
    assert alarm_text("cylinder_strokes", "gap", None).startswith("Cylinder lengths were missing. ")
    assert event_meaning("gap", StrokeReading.ANGLE) == "longer pause between angles, bridged"
    assert event_meaning("gap", StrokeReading.LENGTH) == "longer pause between strokes, bridged"
    assert event_meaning("not used", StrokeReading.ANGLE).startswith("a stroke, though angles drive the model")
