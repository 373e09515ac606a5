"""Hooks of MkDocs: pages made from the sources, and links that hold in the folder as well as on the site.

Pages that are no file in ``docs/``: CONTRIBUTING.md and CHANGELOG.md of the root, the notation, the table of settings, and the
API reference, one page for each folder of the package in the order of the import layers. A link may name any file of the
repository that has a page.
"""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path, PurePosixPath
from posixpath import join, normpath, relpath
from textwrap import dedent

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from boom_twin.config.settings import Settings, Thresholds, is_live

ROOT = Path(__file__).parents[1]
ROOT_PAGES = ("CONTRIBUTING.md", "CHANGELOG.md")
NOTATION, SETTINGS = "boom_twin/kernels/__init__.py", "boom_twin/config/settings.py"
OWN_PAGES = {"README.md": "index.md", NOTATION: "notation.md", SETTINGS: "settings.md", **{name: name for name in ROOT_PAGES}}
TAGS, TEXT = r"(?:<[^>]+>)*", r"(?:<[^>]+>|[^()<])*"
SHAPE = re.compile(rf"\({TAGS}ndarray{TAGS}, {TAGS}shape{TAGS}\(({TEXT}(?:\({TEXT}\){TEXT})?)\)\)")
PLACED = re.compile(r"^ |\S   |^\[")
LINK = re.compile(r"(\]\()([^)\s#:]+)")


def docstring(path: Path) -> str:
    """Docstring of a module that is not imported."""
    return ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""


def rooms() -> list[str]:
    """Folders and modules right in the package, those first that import the others."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    layers = " ".join(project["tool"]["importlinter"]["contracts"][0]["layers"])
    order = re.findall(r"boom_twin\.(\w+)", layers)
    found = {path.parent.name for path in ROOT.glob("boom_twin/*/__init__.py")}
    found |= {path.stem for path in ROOT.glob("boom_twin/*.py") if path.stem != "__init__"}
    return sorted(found, key=lambda room: (order.index(room) if room in order else len(order), room))


def modules(room: str) -> list[str]:
    """Dotted names of all modules of a room, the notation apart, which has a page of its own."""
    place = ROOT / "boom_twin" / room
    if not place.is_dir():
        return [f"boom_twin.{room}"]
    paths = sorted(place.rglob("*.py"), key=lambda path: (len(path.parts), path))
    files = [path.relative_to(ROOT) for path in paths if path.name != "__init__.py"]
    return [".".join(file.with_suffix("").parts) for file in files]


def room_page(room: str) -> str:
    """Markdown of a page of the reference."""
    place = ROOT / "boom_twin" / room
    told = docstring(place / "__init__.py") if place.is_dir() else ""
    told = told.partition("\n\n")[0] if place / "__init__.py" == ROOT / NOTATION else told  # it has a page of its own
    head = f"# {room}\n\n{told}\n" if place.is_dir() else ""
    return head + "".join(f"\n::: {module}\n    options: {{heading_level: 2}}\n" for module in modules(room))


def notation_page() -> str:
    """Markdown of the notation: its headings and paragraphs, while columns, formulas and sources keep their places."""
    first, *sections = re.split(r"\n\n(?=\S)", docstring(ROOT / NOTATION))
    page = f"# Notation\n\n{first}\n"
    for section in sections:
        heading, body = section.split("\n", 1)
        blocks = dedent(body).split("\n\n")
        page += f"\n## {heading}\n"
        page += "".join(f"\n```text\n{dedent(block)}\n```\n" if PLACED.search(block) else f"\n{block}\n" for block in blocks)
    return page


def settings_page() -> str:
    """Markdown of the table of settings: unit, range and meaning of each parameter of the twin and of ``/diagnostics``."""
    page = "# Settings\n\nParameters of the node, of `replay --params` and of `load_settings`, in SI units.\n"
    signs = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
    for title, table in (("The twin", Settings), ("Thresholds of `/diagnostics`", Thresholds)):
        page += f"\n## {title}\n\n| name | default | range | meaning, unit | changes while running |\n|---|---|---|---|---|\n"
        for name, field in table.model_fields.items():
            bounds = [
                f"{sign} {getattr(rule, key):g}" for rule in field.metadata for key, sign in signs.items() if hasattr(rule, key)
            ]
            row = (f"`{name}`", f"{field.default:g}", ", ".join(bounds), field.description, "yes" if is_live(field) else "no")
            page += f"| {' | '.join(map(str, row))} |\n"
    return page


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Complete the part of the navigation that is not written down."""
    reference = next(part["API reference"] for part in config.nav or [] if "API reference" in part)
    reference += [{room: f"reference/{room}.md"} for room in rooms()]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are no file in ``docs/``."""
    pages = {name: (ROOT / name).read_text(encoding="utf-8") for name in ROOT_PAGES}
    pages |= {
        "notation.md": notation_page(),
        "settings.md": settings_page(),
        **{f"reference/{room}.md": room_page(room) for room in rooms()},
    }
    for name, text in pages.items():
        files.append(File.generated(config, name, content=text))
    return files


def page_of(path: str) -> str | None:
    """Where on the site a file or folder of the repository is shown."""
    if path in OWN_PAGES:
        return OWN_PAGES[path]
    top, *rest = PurePosixPath(path).parts
    if top == "docs" and rest:
        return "/".join(rest)
    if top == "boom_twin" and rest:
        room = f"reference/{rest[0].removesuffix('.py')}.md"
        return f"{room}#{path.removesuffix('.py').replace('/', '.')}" if path.endswith(".py") else room
    return None


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn links between files of the repository into links between pages; what is no such file is left for MkDocs to judge."""
    uri = page.file.src_uri
    here = uri if uri in ROOT_PAGES else f"docs/{uri}"

    def turned(found: re.Match[str]) -> str:
        target = normpath(join(str(PurePosixPath(here).parent), found[2]))
        to = page_of(target) if (ROOT / target).exists() else None
        return found[0] if to is None else found[1] + relpath(to, str(PurePosixPath(uri).parent))

    return LINK.sub(turned, markdown)


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Write shapes of arrays as the docstrings do: "ndarray, shape (n,)" is taken for Python's tuple of a name and a call."""

    def turned(found: re.Match[str]) -> str:
        shape = re.sub(r"<[^>]+>", "", found[1])
        return f"ndarray, shape ({shape if ',' in shape else shape + ','})"

    return SHAPE.sub(turned, html)
