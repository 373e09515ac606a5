"""The site of the documentation: it builds without a warning, asks for nothing from elsewhere, and can be searched."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.slow
pytest.importorskip("mkdocs", reason="mkdocs is not installed: pip install .[docs]")

ELSEWHERE = r"(?:https?:)?//[^\s)>]*"
BY_ELEMENT = rf"<(?:script|img|iframe|source|video|audio|embed)\b[^>]*?\bsrc(?:set)?=[\"']?\s*{ELSEWHERE}"
BY_LINK = rf"<link\b[^>]*?\bhref=[\"']?\s*{ELSEWHERE}"
BY_STYLE = rf"(?:@import\s+[\"']?|url\(\s*[\"']?){ELSEWHERE}"
LOADED = re.compile(f"{BY_ELEMENT}|{BY_LINK}|{BY_STYLE}", re.IGNORECASE)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(out)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return out


def external_loads(site: Path) -> list[str]:
    """What pages and style sheets name to be loaded from another host."""
    paths = [path for path in sorted(site.rglob("*")) if path.suffix in (".html", ".css", ".svg")]
    return [f"{path.name}: {load}" for path in paths for load in LOADED.findall(path.read_text(encoding="utf-8"))]


def test_nothing_is_named_from_another_host(site: Path) -> None:
    assert len(list(site.rglob("*.html"))) > 40
    assert external_loads(site) == []
    diagrams = [path.name for path in site.rglob("*.html") if 'class="mermaid"' in path.read_text(encoding="utf-8")]
    assert diagrams == []  # the theme's script would fetch its renderer


def test_every_module_has_its_place_in_the_reference(site: Path) -> None:
    pages = "".join(path.read_text(encoding="utf-8") for path in site.glob("reference/*.html"))
    for path in (ROOT / "boom_twin").rglob("*.py"):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        if path.name not in ("__init__.py", "notation.py") and not path.name.endswith(".launch.py"):
            assert f'id="{name}"' in pages, name


def test_opened_as_files_it_asks_for_nothing_and_can_be_searched(site: Path, browser: Any) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    asked, failed = [], []
    page.on("request", lambda request: asked.append(request.url))
    page.on("requestfailed", lambda request: failed.append(f"{request.failure}: {request.url}"))
    page.on("pageerror", lambda error: failed.append(str(error)))
    for path in sorted(site.rglob("*.html")):
        if path.name == "404.html":  # for servers: its links begin at the root
            continue
        page.goto(path.as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= 1280, path.name
    page.goto((site / "index.html").as_uri())
    page.locator("input.md-search__input").click()
    page.locator("input.md-search__input").press_sequentially("riccati")
    page.locator(".md-search-result__item", has_text="Riccati").first.wait_for(timeout=60_000)
    page.close()
    assert [url for url in asked if not url.startswith(("file://", "data:", "about:", "blob:"))] == []
    assert [reason for reason in failed if not reason.startswith("net::ERR_ABORTED")] == []  # that is: by leaving the page
