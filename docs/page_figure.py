"""Takes the picture of the live page for the documentation, in Debian's Chromium: a session whose third encoder jumps."""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).parents[1] / "test"))
CHROMIUM = Path("/usr/bin/chromium")
FAULT = 25.0  # s of the session that is shown


def page_picture(path: Path) -> None:
    """Write the picture, 1280 by 720 pixels."""
    from monitor.conftest import monitoring, spoil
    from playwright.sync_api import sync_playwright

    with TemporaryDirectory() as folder, sync_playwright() as playwright:
        session = Path(folder) / "encoder_3_jumps"
        spoil(session)
        with monitoring(Path(folder) / "log", "--bag", str(session)) as monitor:
            browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1280, "height": 720}, color_scheme="dark")
            page.goto(monitor.url)
            while not page.evaluate("globalThis.twin?.timeline.isRead"):
                page.wait_for_timeout(200)
            page.evaluate(f"twin.timeline.hold(true); twin.timeline.seek({FAULT})")
            page.wait_for_timeout(4000)
            page.screenshot(path=path)
            browser.close()
