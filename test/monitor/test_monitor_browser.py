"""The page itself, in Debian's Chromium: every element by its name, and its numbers against those of the session."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from eventually import eventually
from matplotlib.image import imread

from boom_twin import frequency_response
from boom_twin.monitor.data.feed import Feed

sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: pip install .[test]")
CHROMIUM = Path("/usr/bin/chromium")
pytestmark = pytest.mark.skipif(not CHROMIUM.is_file(), reason="chromium is not there (Debian: apt-get install chromium)")
PATIENCE = 60_000  # ms
FAULT = 25.0  # s, where encoder 3 is known to be wrong
RESPONSE = "twin.response.chart.plot.data.map(row => Array.from(row))"


class Monitor:
    """``boom_twin monitor`` as a process."""

    def __init__(self, *arguments: str) -> None:
        command = [sys.executable, "-m", "boom_twin.cli.main", "monitor", "--port", "0", *arguments]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        assert self.process.stderr is not None
        for line in self.process.stderr:
            if found := re.search(r"open (http\S+)", line):
                self.url = found[1]
                return
        raise AssertionError("the monitor did not start")

    def stop(self) -> int:
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(20)


@pytest.fixture(scope="module")
def monitor(faulty: Path) -> Iterator[Monitor]:
    """Of the faulty session."""
    monitor = Monitor("--bag", str(faulty))
    yield monitor
    monitor.process.kill()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def page(browser: Any, monitor: Monitor) -> Iterator[Any]:
    """At the fault, held."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    page.asked, page.errors = [], []
    page.on("request", lambda request: page.asked.append(request.url))
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.goto(monitor.url)
    wait(page, "twin.timeline.isRead", 300_000)
    go(page, FAULT)
    yield page
    assert not page.errors
    context.close()


def wait(page: Any, condition: str, patience: int = PATIENCE) -> None:
    """Until `condition` holds; by evaluation from outside, because the page's policy allows no evaluation within."""
    end = time.monotonic() + patience / 1000
    while not page.evaluate(condition):
        assert time.monotonic() < end, condition
        page.wait_for_timeout(50)


def go(page: Any, moment: float) -> None:
    """Hold, and go there."""
    page.evaluate(f"twin.timeline.hold(true); twin.timeline.seek({moment})")
    wait(page, f"twin.timeline.isHeld && Math.abs(twin.view.newest - {moment}) < 0.1")
    page.wait_for_timeout(1200)  # lamps and figures come twice a second


def cells(page: Any, selector: str) -> list[list[str]]:
    return [[cell.strip() for cell in row.split("\t")] for row in page.locator(f"{selector} tr").all_inner_texts()]


def test_the_first_glance_says_what_is_wrong_in_word_shape_and_reason(page: Any) -> None:
    overall = page.locator("#overall")

    def the_fault() -> None:
        assert page.locator("#dropped").is_hidden()
        assert overall.get_attribute("data-level") == "ERROR" and overall.locator(".word").inner_text() == "FAULT"
        assert overall.locator(".reason").inner_text().startswith("joint_3: joint_3.sensor jumped")
        assert overall.locator(".sign").inner_text() == "✖" and "joint_3" in overall.locator(".reason").inner_text()
        expected = {"sensors": "OK", "model": "OK", "residuals": "ERROR", "timing": "OK", "recorder": "OFF"}
        assert {name: page.locator(f"#group-{name}").get_attribute("data-level") for name in expected} == expected
        assert page.locator("#group-residuals .detail").inner_text() == "for 10 s"
        assert re.fullmatch(r"gap s [\d.]+, limit 0.1, for \d+ s", page.locator("#group-sensors .detail").inner_text())

    eventually(the_fault)
    go(page, 10.0)
    wait(page, "document.querySelector('#overall .word').innerText === 'ALL WELL'")


def test_the_figures_are_those_of_the_rows(page: Any, feed: Feed) -> None:
    names = {
        "accel. forward, m/s²": ("acceleration", 0, 1.0),
        "displ. up, mm": ("displacement", 1, 1e3),
        "resid. joint_3, mrad": ("joints", 2, 1e3),
        "IMU measured z, m/s²": ("force", 1, 1.0),
        "IMU predicted x, m/s²": ("force", 2, 1.0),
    }

    def of_the_rows() -> None:
        shown = {row[0]: [float(cell) for cell in row[1:]] for row in cells(page, "#figures")[1:]}
        low, high = page.evaluate("twin.view.span")
        for name, (table, column, factor) in names.items():
            times, values = feed.store.tables[table].rows(0, 10**6)
            chosen = factor * values[(times >= low) & (times < high), column].astype(float)
            rms, peak = chosen.std(), np.abs(chosen - chosen.mean()).max()
            expected = [chosen.mean(), rms, peak, np.ptp(chosen), peak / rms]
            assert shown[name][1:] == pytest.approx(expected[1:], rel=2e-3), name
            assert shown[name][0] == pytest.approx(expected[0], rel=2e-3, abs=0.1 * rms), name

    eventually(of_the_rows)


def test_the_exported_table_holds_every_row_that_is_shown(page: Any, feed: Feed) -> None:
    with page.expect_download() as download:
        page.keyboard.press("c")
    rows = list(csv.DictReader(io.StringIO(Path(download.value.path()).read_text())))
    low, high = page.evaluate("twin.view.span")
    times, values = feed.store.tables["acceleration"].rows(0, 10**6)
    chosen = (times >= low) & (times <= high)
    told = [(float(row["t_s"]), float(row["acceleration_z_m_s2"])) for row in rows if row["acceleration_z_m_s2"]]
    assert np.array(told) == pytest.approx(np.stack([times, values[:, 1]], axis=1)[chosen], rel=1e-6, abs=1e-6)
    assert any(row["force_sigma_z_m_s2"] for row in rows) and any(row["joints_joint_3_normalised"] for row in rows)


def test_the_exported_picture_is_one(page: Any) -> None:
    with page.expect_download() as download:
        page.locator("#picture").click()
    picture = imread(download.value.path(), format="png")
    sizes = page.evaluate("[...document.querySelectorAll('#traces canvas')].map(each => [each.width, each.height])")
    assert picture.shape[:2] == (30 + sum(height for _, height in sizes), max(width for width, _ in sizes))
    top = 30
    for _, height in sizes:
        assert len(np.unique(picture[top : top + height].reshape(-1, picture.shape[2]), axis=0)) > 20
        top += height


@pytest.mark.parametrize("name", ["displacement", "acceleration", "force", "residuals"])
def test_every_chart_shows_its_traces_with_a_read_out(page: Any, name: str) -> None:
    chart = page.locator(f"#chart-{name}")
    data = page.evaluate("name => document.querySelectorAll(`#chart-${name} canvas`).length", name)
    assert data == 1
    box = chart.locator(".u-over").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)

    def the_read_out() -> None:
        values = chart.locator(".u-series:not(.quiet):not(.u-off) .u-value").all_inner_texts()
        assert all(math.isfinite(float(value)) for value in values) and len(values) >= 3
        assert float(values[0]) == pytest.approx(sum(page.evaluate("twin.view.span")) / 2, abs=1.0)

    eventually(the_read_out)


def test_alarms_of_what_is_shown_are_told_in_words_and_as_bars(page: Any, feed: Feed) -> None:
    alarm = next(alarm for alarm in feed.store.alarms.all if alarm.name == "joint_3")
    script = """moments => {
        const canvas = document.querySelector("#chart-acceleration canvas");
        const over = document.querySelector("#chart-acceleration .u-over");
        const [low, high] = twin.view.span, scale = canvas.width / canvas.clientWidth;
        const at = moment => over.offsetLeft + over.clientWidth * (moment - low) / (high - low);
        const context = canvas.getContext("2d"), y = scale * (over.offsetTop + 2);
        const pixel = moment => context.getImageData(scale * at(moment), y, 1, 1).data;
        return moments.map(moment => [...pixel(moment)]) }"""

    def words_and_bars() -> None:
        words = page.locator("#during").inner_text()
        assert words.startswith(f"✖ joint_3: {alarm.reason}, since 15.0 s") and "✖ residual joint_3: " in words
        before, during = page.evaluate(script, [alarm.begin - 2.0, alarm.begin + 2.0])
        assert before[:3] != during[:3] and during[0] > 150 > during[2]

    eventually(words_and_bars)
    go(page, 10.0)
    wait(page, "document.querySelector('#during').innerText === ''")


def test_the_tip_has_a_band_of_what_it_may_be_off_by(page: Any, feed: Feed) -> None:
    assert page.locator("#chart-displacement .u-series").count() == 7 + 6  # those of the estimate
    sigma = feed.store.tables["uncertainty"]
    row = sigma.until(FAULT - 2.0) - 1
    assert 0.0 < sigma.rows(row, row + 1)[1].min() < sigma.rows(row, row + 1)[1].max() < 0.2
    assert page.evaluate(f"twin.connection.table('uncertainty').at(0, {row})") == float(sigma.rows(row, row + 1)[1][0, 0])


def test_the_estimate_has_its_lines_and_bands_and_the_load_is_told(page: Any) -> None:
    go(page, 12.0)

    def the_lines_and_bands() -> None:
        for name, first in (("displacement", 7), ("acceleration", 3)):
            labels = page.locator(f"#chart-{name} .u-legend .u-label").all_inner_texts()
            assert [label for label in labels if label.startswith("est.")] == ["est. forward", "est. up"]
            data = page.evaluate("name => twin.charts(name).plot.data.map(column => column.filter(v => v != null))", name)
            estimate, high, low = (np.array(data[first + i]) for i in (0, 2, 3))
            assert len(estimate) > 100 and (high > estimate).all() and (low < estimate).all()

    eventually(the_lines_and_bands)
    page.keyboard.press("4")
    page.locator("#load", has_text="load at the tip: none above 20 N").wait_for()
    page.keyboard.press("1")


def test_a_chart_is_zoomed_by_dragging_and_all_with_it(page: Any) -> None:
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


def test_times_next_to_nothing_have_no_minus(page: Any) -> None:
    fixed = (
        "import('/page/html_table.js').then(m => [[-0.003, 1], [-0.003, 2], [-0.06, 1], [0, 2]].map(each => m.fixed(...each)))"
    )
    assert page.evaluate(fixed) == ["0.0", "0.00", "-0.1", "0.00"]


def test_missing_rows_are_a_break_in_the_line(page: Any) -> None:
    go(page, 35.0)
    rows = "m.decimate(twin.connection.table('displacement'), [0, 1], 29, 32, 2000)"
    broken = page.evaluate(f"import('/page/decimation.js').then(m => {rows})")
    times, values = np.array(broken[0]), broken[1]
    place = values.index(None)
    assert times[place - 1] == pytest.approx(30.0, abs=0.02) and times[place] == pytest.approx(30.6, abs=0.02)


@pytest.mark.parametrize("seconds", ["10", "30", "60", "180", "600"])
def test_the_span_that_is_shown_can_be_chosen(page: Any, seconds: str) -> None:
    page.locator("#window").select_option(seconds)
    wait(page, f"Math.abs(twin.view.span[1] - twin.view.span[0] - {seconds}) < 1e-6")


def test_a_finger_opens_tabs_and_chooses_a_span(browser: Any, monitor: Monitor) -> None:
    """On a tablet: a tap is a click, a stroke along a chart shows its part, a double tap all of it again."""
    context = browser.new_context(viewport={"width": 1024, "height": 768}, has_touch=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    page.goto(monitor.url)
    wait(page, "twin.timeline.isRead", 300_000)
    go(page, FAULT)
    for tab in ("spectrum", "shape", "traces"):
        page.locator(f"#tabs button[data-tab='{tab}']").tap()
        wait(page, f"getComputedStyle(document.getElementById('{tab}')).display !== 'none'")
    box = page.locator("#charts .u-over").first.bounding_box()
    devtools = context.new_cdp_session(page)

    def touch(kind: str, share: float | None = None) -> None:
        points = [] if share is None else [{"x": box["x"] + share * box["width"], "y": box["y"] + 20}]
        devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 0.7)
    for share in (0.75, 0.8, 0.85, 0.9):
        touch("touchMove", share)
    touch("touchEnd")
    wait(page, "twin.view.zoom !== null")
    low, high = page.evaluate("twin.view.zoom")
    assert high - low == pytest.approx(0.2 * 30.0, rel=0.15)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    context.close()


SIZES = {(1280, 720): 0.62, (2560, 1440): 0.78, (1024, 768): 0.66, (834, 1112): 0.62}
"""Sizes of screens, and what share of the height the tabs have at least."""


@pytest.mark.parametrize("size", SIZES)
def test_every_tab_fits_the_screen(browser: Any, monitor: Monitor, size: tuple[int, int]) -> None:
    """Nothing is cut off at the side, and head, buttons and foot leave the tabs most of the height."""
    context = browser.new_context(viewport={"width": size[0], "height": size[1]})
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    page.goto(monitor.url)
    wait(page, "twin.timeline.isRead", 300_000)
    go(page, 10.0)

    def nothing_cut(tab: str) -> None:
        beyond = "filter(e => e.getBoundingClientRect().right > innerWidth + 1).map(e => e.id)"
        assert page.evaluate(f"[...document.querySelectorAll('body *')].{beyond}") == [], tab
        assert page.evaluate("document.querySelector('main').clientHeight / innerHeight") >= SIZES[size], tab

    for tab in ("traces", "spectrum", "spectrogram", "shape", "state", "path", "response"):
        page.locator(f"#tabs button[data-tab='{tab}']").click()
        wait(page, f"getComputedStyle(document.getElementById('{tab}')).display !== 'none'")
        page.wait_for_timeout(300)
        eventually(partial(nothing_cut, tab))
    page.keyboard.press("1")
    wait(page, "document.querySelectorAll('#figures tr').length > 1")
    right = "[...document.querySelectorAll('#figures tr')].slice(0, 2).map(row => getComputedStyle(row.cells[3]).textAlign)"
    assert page.evaluate(right) == ["right", "right"], "heads stand over their numbers"
    context.close()


def test_spectrum_and_spectrogram(page: Any) -> None:
    page.keyboard.press("2")
    wait(page, "document.querySelectorAll('#peaks tr').length > 2")

    def the_spectrum() -> None:
        rows = cells(page, "#peaks")[1:]
        natural = sorted(float(row[3]) for row in rows if row[3][0].isdigit())
        assert len(natural) == 6 and natural[0] == pytest.approx(1.06, abs=0.05)
        peaks = [row for row in rows if row[0]]
        assert float(peaks[0][0]) == pytest.approx(natural[0], rel=0.2) and 0.0 < float(peaks[0][1]) < 20.0
        told = [character.isdigit() for row in peaks for cell in row[2:] for character in cell]
        assert not any(told), "it was moved: of no mode"
        words = page.locator("#peaks caption").inner_text()
        assert words.startswith("measured by the IMU, last 40 s") and "THE BOOM MOVED" in words
        assert page.locator("#density canvas").count() == 1

    def the_spectrogram() -> None:
        words = page.locator("#waterfall-words").inner_text()
        assert "dB" in words and "acceleration, measured by the IMU, both directions" in words and is_drawn(page, "#waterfall")

    eventually(the_spectrum)
    page.keyboard.press("3")
    eventually(the_spectrogram)


def is_drawn(page: Any, canvas: str) -> bool:
    """Whether anything but one colour is on it."""
    pixels = "c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer"
    script = f"id => {{ const c = document.querySelector(id); return new Set(new Uint32Array({pixels})).size }}"
    return bool(page.evaluate(script, canvas) > 3)


def test_the_shape_states_exaggeration_reach_height_and_forces(page: Any, feed: Feed) -> None:
    page.keyboard.press("4")
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

    for factor in (1, 10, 50):
        page.locator(f"#factors button[data-factor='{factor}']").click()
        eventually(partial(drawn, factor))
    eventually(told)


def test_labels_of_cylinders_lie_over_no_line(page: Any) -> None:
    page.keyboard.press("4")
    script = "() => { const s = twin.shape; s.draw(); return s.drawn }"
    drawn: dict[str, list[Any]] = {}

    def all_boxes() -> None:
        drawn.update(page.evaluate(script))
        assert len(drawn["boxes"]) >= 4

    eventually(all_boxes)
    for left, top, right, bottom in drawn["boxes"]:
        for (x0, y0), (x1, y1) in drawn["segments"]:
            along = np.linspace(0.0, 1.0, 500)
            x, y = x0 + along * (x1 - x0), y0 + along * (y1 - y0)
            assert not ((x > left) & (x < right) & (y > top) & (y < bottom)).any()


def test_the_way_of_the_tip_is_drawn_and_told(page: Any) -> None:
    page.keyboard.press("6")

    def drawn_and_told() -> None:
        assert is_drawn(page, "#way")
        assert re.search(r"now \d\.\d{3} m forward, -?\d\.\d{3} m up", page.locator("#way-words").inner_text())

    eventually(drawn_and_told)


def test_no_legend_is_cut_and_a_chart_without_data_takes_no_room(page: Any) -> None:
    def no_legend_cut() -> None:
        for chart in page.locator("#charts .chart:visible").all():
            frame, legend = chart.bounding_box(), chart.locator(".u-legend").bounding_box()
            assert legend["y"] + legend["height"] <= frame["y"] + frame["height"] + 1
            labels = [label.bounding_box() for label in chart.locator(".u-label:visible").all()]
            assert max(label["x"] + label["width"] for label in labels) <= frame["x"] + frame["width"] + 1

    for width in (1280, 820):
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_timeout(600)
        eventually(no_legend_cut)
    empty = "const e = document.createElement('div'); e.className = 'chart'; document.getElementById('charts').append(e)"
    assert page.evaluate(f"(() => {{ {empty}; const seen = e.offsetHeight; e.remove(); return seen }})()") == 0


def test_every_lamp_and_alarm_is_listed_and_can_be_acknowledged(page: Any, feed: Feed) -> None:
    page.keyboard.press("5")
    groups = feed.store.statuses(FAULT).groups(FAULT).values()

    def all_listed() -> None:
        lamps = cells(page, "#lamps")
        assert {row[1] for row in lamps[1:]} == {lamp.name for group in groups for lamp in group} - {"health"} | {"joint_3"}
        judged = next(row for row in cells(page, "#alarms") if row[0] == "joint_3")
        assert judged[1] == "✖ ERROR" and judged[3:6] == ["joint_3.sensor", "15.00", "lasts"]
        wrong = next(row for row in lamps if row[1] == "residual joint_3")
        assert wrong[2] == "✖ ERROR" and wrong[3].startswith("joint_3.sensor jumped")

    eventually(all_listed)
    alarms = page.locator("#alarms tr", has_text="residual joint_3")
    alarms.locator("button").click()
    alarms.get_by_text("acknowledged").wait_for()
    wait(page, "document.querySelector('#answer').innerText === 'acknowledged: residual joint_3'")


def test_the_time_line_shows_alarms_and_gaps_and_jumps_between_them(page: Any, replayed: Path) -> None:
    alarms = json.loads((replayed / "summary.json").read_text())["alarms"]
    gap = next(alarm for alarm in alarms if alarm["kind"] == "gap")

    def marks() -> None:
        titles = page.locator("#marks i").evaluate_all("marks => marks.map(mark => mark.title)")
        assert any("residual joint_3" in title for title in titles)
        assert any(title.startswith("cylinder_strokes: gap of 0.6") and f"{gap['from_s']:.2f} s" in title for title in titles)

    eventually(marks)
    page.evaluate("twin.timeline.seek(20)")
    wait(page, "Math.abs(twin.timeline.position - 20) < 0.1 && Math.abs(twin.view.newest - 20) < 0.1")
    page.locator("#after").click()
    wait(page, f"Math.abs(twin.timeline.position - {gap['from_s']}) < 0.1")
    page.keyboard.press(",")
    wait(page, "twin.timeline.position < 20")


def test_scrubber_speed_and_play(page: Any) -> None:
    page.locator("#scrubber").fill("12")
    wait(page, "Math.abs(twin.timeline.position - 12) < 0.1")
    page.locator("#speed").select_option("5")
    page.locator("#play").click()
    wait(page, "twin.timeline.position > 18")
    page.keyboard.press(" ")
    wait(page, "twin.timeline.isHeld")
    wait(page, "document.querySelector('#play').innerText === 'Play'")
    assert re.fullmatch(r"[\d.]+ of 40\.00 s", page.locator("#position").inner_text())


def test_what_is_not_permitted_cannot_be_pressed(page: Any) -> None:
    assert page.locator("#mark").is_disabled() and page.locator("#record").is_hidden() and page.locator("#pause").is_hidden()


def test_dark_and_light_by_key_kept_over_a_reload(page: Any) -> None:
    def themes() -> tuple[str, str]:
        return page.evaluate("[document.documentElement.dataset.theme, getComputedStyle(document.body).backgroundColor]")

    before = themes()
    page.keyboard.press("t")
    wait(page, f"document.documentElement.dataset.theme !== '{before[0]}'")
    after = themes()
    assert before[0] != after[0] and before[1] != after[1]
    page.reload()
    wait(page, f"document.documentElement.dataset.theme === '{after[0]}'")
    wait(page, f"document.querySelector('#theme').innerText === '{'Light' if after[0] == 'dark' else 'Dark'}'")


def test_the_response_in_this_posture_with_the_measured_spectrum_over_it(page: Any, feed: Feed) -> None:
    page.keyboard.press("7")
    wait(page, "twin.response.chart && twin.response.chart.plot.data.length === 7", 300_000)  # the first compiles
    frequencies = np.array(page.evaluate(RESPONSE)[0])
    response = frequency_response(None, frequencies, strokes=feed.strokes(FAULT), drive=2).tip_acceleration

    def of_this_posture() -> None:
        words = page.locator("#response-words").inner_text()
        assert words.startswith("amplitude of the tip's acceleration") and "measured by the IMU, last 40 s" in words
        _, *curves, measured = page.evaluate(RESPONSE)
        assert np.array(curves[2]) == pytest.approx(1e-3 * np.linalg.norm(response, axis=1), rel=2e-2)
        assert len(curves) == 5 and sum(value is not None for value in measured) > 300
        labels = page.locator("#answers .u-label").all_inner_texts()
        assert labels[1:3] == ["1 N at the tip, up", "1 mm of cylinder 1"] and "measured by the IMU" in labels[-1]
        box = page.locator("#answers canvas").bounding_box()
        assert box["height"] > 300 and box["width"] > 800

    eventually(of_this_posture)


ONE_AFTER_THE_OTHER = """async () => {
    const now = twin.response.response, scaled = factor => ({ ...now, values: now.values.map(value => factor * value) });
    twin.connection.emit("response", scaled(2));
    for (let frame = 0; twin.response.isNew && frame < 300; frame++) await new Promise(requestAnimationFrame);
    twin.connection.emit("response", scaled(3));
    return now.values[0];
}"""


def test_a_response_that_comes_right_after_another_was_drawn_is_drawn_too(page: Any) -> None:
    """In the same frame, while nothing else changes: of a held session the page went on showing the posture before."""
    page.keyboard.press("7")
    wait(page, "twin.response.chart && twin.response.chart.plot.data.length === 7", 300_000)
    page.wait_for_timeout(2500)  # the server's own, of this posture, has come
    first = page.evaluate(ONE_AFTER_THE_OTHER)
    wait(page, f"Math.abs(twin.response.chart.plot.data[1][0] / {first} - 3) < 1e-5", 10_000)


@pytest.mark.parametrize("size", [(1280, 720), (820, 1180), (1180, 820)])
@pytest.mark.parametrize("tab", ["1", "2", "3", "4", "5", "6", "7"])
def test_nothing_is_cut_off_at_the_sides(page: Any, size: tuple[int, int], tab: str) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.keyboard.press(tab)
    page.wait_for_timeout(400)

    def nothing_cut() -> None:
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        for selector in ("#overall", "#group-recorder", "#tabs", "#theme", "#timeline"):
            box = page.locator(selector).bounding_box()
            assert box["x"] >= 0 and box["x"] + box["width"] <= size[0] and box["height"] > 20, selector

    eventually(nothing_cut)


def test_everything_comes_from_this_server(page: Any, monitor: Monitor) -> None:
    assert len(page.asked) > 10 and all(url.startswith((monitor.url, "data:", "ws://127.0.0.1")) for url in page.asked)


@pytest.mark.slow
def test_two_minutes_of_six_traces_at_200_hz() -> None:
    bench = Path(__file__).parents[1] / "bench" / "monitor.py"
    done = subprocess.run([sys.executable, str(bench)], capture_output=True, text=True, timeout=400)
    print(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_page_itself_says_that_the_monitor_is_gone_and_comes_back(browser: Any, replayed: Path) -> None:
    monitor = Monitor("--bag", str(replayed / "bag"))
    page = browser.new_page()
    page.goto(monitor.url)
    wait(page, "twin.connection.table('displacement')?.count > 0")
    assert page.locator("#notice").is_hidden()
    assert page.locator("#overall .word").inner_text() == "STALE"  # no node is in a result bag
    assert monitor.stop() == 0
    page.locator("#notice", has_text="NO CONNECTION").wait_for(timeout=5000)
    assert {lamp.get_attribute("data-level") for lamp in page.locator(".lamp").all()} == {"STALE"}
    again = Monitor("--bag", str(replayed / "bag"), "--port", monitor.url.rsplit(":", 1)[1].strip("/"))
    page.locator("#notice").wait_for(state="hidden", timeout=10_000)
    again.stop()
    page.close()
