"""The page in Debian's Chromium: its elements by their names, its numbers against those of the session."""

from __future__ import annotations

import csv
import io
import json
import re
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from eventually import eventually
from monitor.conftest import MonitorProcess, monitoring

from boom_twin.monitor.data.feed import Feed
from boom_twin.texts import FILE, LANGUAGES

PATIENCE = 240_000  # ms
FAULT = 25.0  # s, when encoder 3 is known to be wrong
TABS = ("traces", "spectrum", "shape", "state", "path")


@pytest.fixture(scope="module")
def monitor(faulty: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[MonitorProcess]:
    with monitoring(tmp_path_factory.mktemp("monitor") / "log", "--bag", str(faulty)) as process:
        yield process


def opened(browser: Any, monitor: MonitorProcess, width: int, height: int, **options: Any) -> Any:
    """Return the page once the session is read, held at the fault."""
    page = browser.new_context(viewport={"width": width, "height": height}, **options).new_page()
    page.set_default_timeout(PATIENCE)
    page.asked, page.errors = [], []
    page.on("request", lambda request: page.asked.append(request.url))
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.goto(monitor.url)
    wait(page, "window.twin?.timeline.isRead", 900_000)  # a page in another language reads its texts first
    go(page, FAULT)
    return page


@pytest.fixture
def page(browser: Any, monitor: MonitorProcess) -> Iterator[Any]:
    page = opened(browser, monitor, 1280, 720, accept_downloads=True)
    yield page
    assert not page.errors
    page.context.close()


def wait(page: Any, condition: str, patience: int = PATIENCE) -> None:
    """Wait until `condition` holds; evaluated from outside, because the page's policy allows no evaluation within."""
    end = time.monotonic() + patience / 1000
    while not page.evaluate(condition):
        assert time.monotonic() < end, condition
        page.wait_for_timeout(50)


def go(page: Any, moment: float) -> None:
    """Hold, and go to a time (s)."""
    page.evaluate(f"twin.timeline.hold(true); twin.timeline.seek({moment})")
    wait(page, f"twin.timeline.isHeld && Math.abs(twin.view.newest - {moment}) < 0.1")


def cells(page: Any, selector: str) -> list[list[str]]:
    return [[cell.strip() for cell in row.split("\t")] for row in page.locator(f"{selector} tr").all_inner_texts()]


def is_drawn(page: Any, canvas: str) -> bool:
    pixels = "c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer"
    script = f"id => {{ const c = document.querySelector(id); return new Set(new Uint32Array({pixels})).size }}"
    return bool(page.evaluate(script, canvas) > 3)


def test_the_first_glance_says_what_is_wrong_in_word_shape_and_reason(page: Any, monitor: MonitorProcess) -> None:
    overall = page.locator("#overall")

    def the_fault() -> None:
        assert page.locator("#dropped").is_hidden()
        assert overall.get_attribute("data-level") == "ERROR" and overall.locator(".word").inner_text() == "LOOK"
        assert overall.locator(".reason").inner_text().startswith("Angle sensor of joint 3 jumped")
        assert overall.locator(".sign").inner_text() == "✖"
        expected = {"sensors": "ERROR", "model": "OK", "residuals": "ERROR", "timing": "OK", "recorder": "OFF"}
        assert {name: page.locator(f"#group-{name}").get_attribute("data-level") for name in expected} == expected
        told = page.locator("#group-sensors").get_attribute("title")
        assert re.search(r"^Angle sensor of joint 3 jumped.*; missing share 0, limit 0.5$", told)

    eventually(the_fault)
    assert page.locator("#mark").is_disabled() and page.locator("#pause").is_hidden()
    assert len(page.asked) > 10 and all(url.startswith((monitor.url, "data:", "ws://127.0.0.1")) for url in page.asked)
    go(page, 10.0)
    wait(page, "document.querySelector('#overall .word').innerText === 'GO ON'")


def test_figures_and_table_are_those_of_the_rows_that_are_shown(page: Any, feed: Feed) -> None:
    names = {
        "accel. forward, m/s²": ("acceleration", 0, 1.0),
        "displ. up, mm": ("displacement", 1, 1e3),
        "resid. joint_3, mrad": ("joints", 2, 1e3),
        "IMU measured z, m/s²": ("force", 1, 1.0),
    }
    tables = feed.store.tables

    def figures() -> None:
        shown = {row[0]: [float(cell) for cell in row[1:]] for row in cells(page, "#figures")[1:]}
        low, high = page.evaluate("twin.view.span")
        for name, (table, column, factor) in names.items():
            times, values = tables[table].rows(0, 10**6)
            chosen = factor * values[(times >= low) & (times < high), column].astype(float)
            rms, peak = chosen.std(), np.abs(chosen - chosen.mean()).max()
            assert shown[name][1:] == pytest.approx([rms, peak, np.ptp(chosen), peak / rms], rel=2e-3), name
            assert shown[name][0] == pytest.approx(chosen.mean(), rel=2e-3, abs=0.1 * rms), name

    eventually(figures)
    with page.expect_download() as download:
        page.keyboard.press("c")
    rows = list(csv.DictReader(io.StringIO(Path(download.value.path()).read_text())))
    low, high = page.evaluate("twin.view.span")
    times, values = tables["acceleration"].rows(0, 10**6)
    chosen = (times >= low) & (times <= high)
    told = [(float(row["t_s"]), float(row["acceleration_z_m_s2"])) for row in rows if row["acceleration_z_m_s2"]]
    assert np.array(told) == pytest.approx(np.stack([times, values[:, 1]], axis=1)[chosen], rel=1e-6, abs=1e-6)
    assert any(row["force_sigma_z_m_s2"] for row in rows) and any(row["joints_joint_3_normalised"] for row in rows)


def test_an_alarm_is_told_once_with_what_to_do_and_in_the_log(page: Any, feed: Feed, replayed: Path) -> None:
    alarm = next(alarm for alarm in feed.store.alarms.all if alarm.name == "joint_3")
    gap = next(each for each in json.loads((replayed / "summary.json").read_text())["alarms"] if each["kind"] == "gap")
    height = "document.querySelector('#charts').getBoundingClientRect().height"
    before = page.evaluate(height)

    def words_and_marks() -> None:
        assert page.locator("#overall .word").inner_text() == "LOOK"
        assert page.locator("#overall .reason").inner_text() == alarm.reason
        assert page.locator("#overall .detail").inner_text().endswith("since 15.00 s")
        titles = page.locator("#marks i").evaluate_all("marks => marks.map(mark => mark.title)")
        assert any(title.startswith(f"cylinder_strokes: {gap['told']} {gap['from_s']:.2f} s") for title in titles)

    eventually(words_and_marks)
    page.keyboard.press("4")
    groups = feed.store.statuses(FAULT).groups(FAULT).values()

    def lists() -> None:
        lamps = cells(page, "#lamps")
        assert {row[1] for row in lamps[1:]} == {lamp.name for group in groups for lamp in group} - {"health"} | {"joint_3"}
        (judged,) = [row for row in cells(page, "#alarms") if "joint_3" in row[0]]
        assert judged[1] == "✖ ERROR" and judged[3:6] == ["joint_3.sensor", "15.00 s", "lasts"]

    eventually(lists)
    page.locator("#acknowledge", has_text="Acknowledge (1)").click()
    wait(page, "document.querySelector('#answer').innerText === 'acknowledged: joint_3'")
    page.locator("#acknowledge").wait_for(state="hidden")
    page.keyboard.press("1")
    go(page, 10.0)
    wait(page, "document.querySelector('#overall .word').innerText === 'GO ON'")
    assert page.evaluate(height) == before, "the traces keep their height"


def test_tip_and_pump_are_shown_against_what_they_may_be(page: Any, feed: Feed) -> None:
    lamp = next(lamp for lamp in feed.store.statuses(FAULT).groups(FAULT)["model"] if lamp.name == "swing")

    def told() -> None:
        swing, limit = page.locator("#tip-now b").inner_text(), page.locator("#tip-now span").inner_text()
        assert abs(float(swing.split()[2]) - 1e3 * lamp.value) <= 1.0 and limit == "limit 300 mm"
        assert page.locator("#tip-now").get_attribute("data-level") == "OK"
        assert page.locator("#pump-now b").inner_text() == "no pump pulses"

    eventually(told)


@pytest.mark.parametrize(("language", "go_on"), [("de", "WEITER"), ("zh", "继续")])
def test_the_page_speaks_the_language_of_its_viewer(
    browser: Any, monitor: MonitorProcess, feed: Feed, language: str, go_on: str
) -> None:
    alarm = next(alarm for alarm in feed.store.alarms.all if alarm.name == "joint_3")
    page = opened(browser, monitor, 1280, 720, locale=language)
    wait(page, f"document.querySelector('#overall .reason').innerText === {json.dumps(alarm.words[language])}")
    go(page, 10.0)
    wait(page, f"document.querySelector('#overall .word').innerText === '{go_on}'")
    table = json.loads(FILE.read_text(encoding="utf-8"))
    at = LANGUAGES.index(language) - 1
    assert [tab.strip() for tab in page.locator("#tabs span").all_inner_texts()] == [
        table[name][at] for name in ("Traces", "Spectrum", "Shape", "Alarms", "Path")
    ]
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    with page.expect_navigation():
        page.locator("#language").select_option("en")
    wait(page, "document.querySelector('#overall .word').innerText === 'GO ON'")
    page.goto(monitor.url + f"?lang={language}")
    wait(page, f"document.documentElement.lang === '{language}'")
    assert not page.errors
    page.context.close()


SETTLED = """async () => {
  for (let same = 0, width = 0; same < 60;) {
    await new Promise(requestAnimationFrame);
    const now = document.querySelector('#chart-acceleration .u-over').clientWidth;
    same = now === width ? same + 1 : 0;
    width = now;
  }
}"""
"""Ends when the layout has had its width for 60 pictures."""


def test_time_is_chosen_by_dragging_by_span_by_marks_and_by_playing(page: Any) -> None:
    page.evaluate(SETTLED)
    box = page.locator("#chart-acceleration .u-over").bounding_box()
    page.mouse.move(box["x"] + 0.7 * box["width"], box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.9 * box["width"], box["y"] + 20, steps=5)
    page.mouse.up()
    wait(page, "twin.view.zoom !== null")
    low, high = page.evaluate("twin.view.span")
    assert high - low == pytest.approx(6.0, abs=0.2)
    page.locator("#all").click()
    wait(page, "twin.view.zoom === null")
    for seconds in ("10", "600", "30"):
        page.locator("#window").select_option(seconds)
        wait(page, f"Math.abs(twin.view.span[1] - twin.view.span[0] - {seconds}) < 1e-6")
    go(page, 20.0)
    page.locator("#after").click()
    wait(page, "Math.abs(twin.timeline.position - 30) < 0.1")  # the gap
    page.keyboard.press(",")
    wait(page, "twin.timeline.position < 20")
    page.locator("#scrubber").fill("12")
    wait(page, "Math.abs(twin.timeline.position - 12) < 0.1")
    page.locator("#speed").select_option("5")
    page.locator("#play").click()
    wait(page, "twin.timeline.position > 18")
    page.keyboard.press(" ")
    wait(page, "twin.timeline.isHeld && document.querySelector('#play').innerText === 'Play'")
    assert re.fullmatch(r"[\d.]+ of 40\.00 s", page.locator("#position").inner_text())


SIZES = {(1280, 720): 0.62, (2560, 1440): 0.78, (1024, 768): 0.66, (820, 1180): 0.7, (390, 844): 0.4}
"""Sizes of screens, and what share of the height the tabs have at least."""


@pytest.mark.parametrize("size", SIZES)
def test_every_tab_fits_the_screen(browser: Any, monitor: MonitorProcess, size: tuple[int, int]) -> None:
    """Nothing is cut off at the side, and head, buttons and foot leave the tabs enough of the height."""
    page = opened(browser, monitor, *size)
    go(page, 10.0)

    def nothing_cut(tab: str) -> None:
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), tab
        beyond = "filter(e => e.getBoundingClientRect().right > innerWidth + 1).map(e => e.id)"
        assert page.evaluate(f"[...document.querySelectorAll('body *')].{beyond}") == [], tab
        assert page.evaluate("document.querySelector('main').clientHeight / innerHeight") >= SIZES[size], tab

    for tab in TABS:
        page.locator(f"#tabs button[data-tab='{tab}']").click()
        wait(page, f"getComputedStyle(document.getElementById('{tab}')).display !== 'none'")
        eventually(partial(nothing_cut, tab))
    page.keyboard.press("1")

    def no_legend_cut() -> None:
        for chart in page.locator("#charts .chart:visible").all():
            frame, legend = chart.bounding_box(), chart.locator(".u-legend").bounding_box()
            assert legend["y"] + legend["height"] <= frame["y"] + frame["height"] + 1
        assert len(cells(page, "#figures")) > 1
        right = "[...document.querySelectorAll('#figures tr')].slice(0, 2).map(row => getComputedStyle(row.cells[3]).textAlign)"
        assert page.evaluate(right) == ["right", "right"], "heads stand over their numbers"

    eventually(no_legend_cut)
    page.context.close()


def test_spectrum_with_its_peaks(page: Any) -> None:
    page.keyboard.press("2")
    wait(page, "document.querySelectorAll('#peaks tr').length > 2")

    def the_spectrum() -> None:
        rows = cells(page, "#peaks")[1:]
        natural = sorted(float(row[2]) for row in rows if row[2][0].isdigit())
        assert len(natural) == 6 and natural[0] == pytest.approx(1.06, abs=0.05)
        peaks = [row for row in rows if row[0]]
        assert float(peaks[0][0]) == pytest.approx(natural[0], rel=0.2)
        told = [character.isdigit() for row in peaks for cell in row[1:] for character in cell]
        assert not any(told), "the boom moved: a peak is of no mode"
        words = page.locator("#peaks caption").inner_text()
        assert words.startswith("measured by the IMU, last 40 s") and "THE BOOM MOVED" in words
        assert page.locator("#density canvas").count() == 1

    eventually(the_spectrum)


def test_shape_and_path_are_drawn_and_told_in_figures(page: Any, feed: Feed) -> None:
    page.keyboard.press("3")
    table = feed.store.tables["shape"]
    row = table.until(FAULT)
    values = dict(zip(table.columns, table.rows(row - 1, row)[1][0].tolist(), strict=True))
    last = max(int(name.split("_")[1]) for name in values if name.startswith("line_"))
    strongest = max(abs(value) for name, value in values.items() if name.startswith("force_"))

    def drawn(factor: int) -> None:
        assert f"x{factor};" in page.locator("#exaggeration").inner_text() and is_drawn(page, "#boom")

    def told() -> None:
        assert page.locator("#reach").inner_text() == f"reach {values[f'line_{last}_x_m']:.3f} m"
        assert page.locator("#height").inner_text() == f"height {values[f'line_{last}_z_m']:.3f} m"
        assert f"{strongest / 1e3:.1f} kN" in page.locator("#forces").inner_text()

    eventually(partial(drawn, 1))  # true to scale at first
    for factor in (10, 50, 1):
        page.locator(f"#factors button[data-factor='{factor}']").click()
        eventually(partial(drawn, factor))
    eventually(told)
    page.keyboard.press("5")

    def path() -> None:
        assert is_drawn(page, "#way")
        assert re.search(r"now \d\.\d{3} m forward, -?\d\.\d{3} m up", page.locator("#way-words").inner_text())

    eventually(path)


def test_the_page_says_that_the_monitor_is_gone_and_comes_back(browser: Any, replayed: Path, tmp_path: Path) -> None:
    bag = ("--bag", str(replayed / "bag"))
    with monitoring(tmp_path / "log", *bag) as monitor:
        page = browser.new_page()
        page.goto(monitor.url)
        wait(page, "twin.connection.table('displacement')?.count > 0")
        assert page.locator("#notice").is_hidden()
        assert page.locator("#overall .word").inner_text() == "NOT KNOWN"  # no node is in a result bag
        assert monitor.stop() == 0
    page.locator("#notice", has_text="NO CONNECTION").wait_for(timeout=PATIENCE)
    assert {lamp.get_attribute("data-level") for lamp in page.locator(".lamp").all()} == {"STALE"}
    with monitoring(tmp_path / "again", *bag, "--port", str(monitor.address[1])):
        page.locator("#notice").wait_for(state="hidden", timeout=PATIENCE)
    page.close()
