"""The documentation tells the truth about the tree: links, paths, folders, commands, topics, figures, the stable names."""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path

import pytest
from command import main
from ruamel.yaml import YAML

import boom_twin
from boom_twin import Settings
from boom_twin.cli.main import COMMANDS
from boom_twin.config.settings import NODE_ONLY, Thresholds, read_parameters

ROOT = Path(__file__).parents[2]
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")]
ADDS = "extending.md"
"""The page that names files which its examples add; `test/extending` holds it."""
FENCED = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
NOT_OF_NOW = ("CHANGELOG.md", ADDS)
LINK = re.compile(r"\]\(([^)\s]+)\)")


def text_of(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def anchors(page: Path) -> set[str]:
    """Of a page's headings, as GitHub and MkDocs make them."""
    headings = re.findall(r"^#+ (.*)$", FENCED.sub("", page.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_relative_links_lead_to_files_and_headings(page: Path) -> None:
    for link in LINK.findall(FENCED.sub("", page.read_text(encoding="utf-8"))):
        if link.startswith(("http:", "https:")):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize("page", [page for page in PAGES if page.name not in NOT_OF_NOW], ids=lambda page: page.name)
def test_quoted_paths_are_there(page: Path) -> None:
    quoted = re.findall(r"(?<![\w/])((?:boom_twin|test|msg_config|docs)/[\w./]*\w)", page.read_text(encoding="utf-8"))
    assert [path for path in quoted if not (ROOT / path).exists()] == []


def test_every_page_stands_in_the_navigation() -> None:
    listed = re.findall(r"([\w/]+\.md)$", text_of("mkdocs.yml"), re.MULTILINE)
    written = [page.relative_to(ROOT / "docs").as_posix() for page in PAGES if page.parent != ROOT]
    assert sorted(listed) == sorted([*written, "CHANGELOG.md", "CONTRIBUTING.md", "notation.md", "settings.md"])


def table_of(page: str) -> list[list[str]]:
    """Of all tables of a text, the cells of each row but heads."""
    rows = [line.strip("| ").split(" | ") for line in re.findall(r"^\|.*\|$", page, re.MULTILINE)]
    return [row for row in rows if row[0] != "what" and not row[0].startswith("---")]


def test_readme_is_short_and_its_figures_are_those_measured() -> None:
    readme = text_of("README.md")
    assert len(readme.splitlines()) <= 100
    measured = table_of(text_of("docs/measured.md"))
    told = table_of(readme.partition("## What was measured")[2])
    assert len(told) >= 8 and [row for row in told if row not in [each[:2] for each in measured]] == []


def test_every_measured_row_says_how_and_when_and_is_kept() -> None:
    kept = json.loads(text_of("docs/measured.json"))
    rows = [row for section in kept["sections"] for row in section["rows"]]
    wanted = [[row[name] for name in ("what", "value", "bound", "command")] for row in rows]
    measured = table_of(text_of("docs/measured.md"))
    assert [row[:4] for row in measured] == wanted
    assert len({row[0] for row in measured}) == len(measured)
    assert all(
        value and command and re.fullmatch(r"this run|[\d-]{10}, [0-9a-f]{7,}\+?", when)
        for _, value, _, command, when in measured
    )
    assert re.search(r"^Measured on [\d-]{10} .* at commit \w+", text_of("docs/measured.md"), re.MULTILINE)


def test_every_command_is_told_and_every_told_command_is_one() -> None:
    readme, page = text_of("README.md"), text_of("docs/commands.md")
    assert set(re.findall(r"^\| `boom_twin (\w+)", page, re.MULTILINE)) == set(COMMANDS)
    assert [name for name in COMMANDS if f"`{name}`" not in readme and f"boom_twin {name}" not in readme] == []
    everything = "\n".join(path.read_text(encoding="utf-8") for path in PAGES)
    told = set(re.findall(r"(?:^|`|bin/)boom_twin ([a-z]+)", everything, re.MULTILINE))
    assert told - set(COMMANDS) == set()


@pytest.mark.parametrize("name", COMMANDS)
def test_options_of_pages_and_of_the_help_are_the_same(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    pages = [path.read_text(encoding="utf-8") for path in PAGES if path.name not in NOT_OF_NOW]
    blocks = "\n".join(block for page in pages for block in FENCED.findall(page))
    lines = [re.split(" #|--ros-args", line)[0] for line in re.findall(rf"^boom_twin {name}\b(.*)", blocks, re.MULTILINE)]
    for kind in ("error", "stability", "parts") if name == "study" else ("",):
        with pytest.raises(SystemExit):
            main([name, *filter(None, [kind]), "--help"])
        known = capsys.readouterr().out
        told = {option for line in lines if kind in line for option in re.findall(r"(?<= )--[a-z-]+", line)}
        assert [option for option in told if option not in known] == []
        assert [option for option in set(re.findall(r"--[a-z-]+", known)) if not any(option in page for page in pages)] == []


def test_topics_are_those_of_the_table() -> None:
    table = YAML(typ="safe", pure=True).load(text_of("msg_config/topics.yaml"))
    rows = text_of("docs/ros.md").partition("## Topics")[2].partition("\n## ")[0]
    told = {name for row in re.findall(r"^\| (`.*?) \|", rows, re.MULTILINE) for name in re.findall(r"`(\S+?)`", row)}
    entries = [*table["inputs"].values(), *table["outputs"].values(), table["events"]]
    assert told == {entry["name"] for entry in entries}


def test_parameters_are_those_of_the_table_of_settings() -> None:
    """The file to start from has every setting with its default, and nothing else but parameters of the node alone."""
    written = read_parameters(ROOT / "msg_config" / "twin.yaml")
    fields = {**Settings.model_fields, **Thresholds.model_fields}
    assert {name: value for name, value in written.items() if name not in NODE_ONLY} == {
        name: field.default for name, field in fields.items()
    }
    assert set(written) == {*fields, *NODE_ONLY}


def test_rooms_are_those_of_the_package() -> None:
    told = re.findall(r"\(boom_twin/([\w.]+)\)", text_of("CONTRIBUTING.md"))
    folders = {path.parent.name for path in ROOT.glob("boom_twin/*/__init__.py")}
    assert set(told) == folders | {"types.py", "sensor_kinds.py", "predictions.py", "errors.py", "texts.py"}
    assert len(told) == len(set(told))


def test_modules_that_are_named_are_there() -> None:
    words = "|".join(path.parent.name for path in ROOT.glob("boom_twin/*/__init__.py"))
    for name in ("CONTRIBUTING.md", "docs/data_flow.svg"):
        found = re.findall(rf"[`>]((?:{words})/[\w/]*\w)[`<]", text_of(name))
        assert len(found) >= 5
        for path in found:
            assert (ROOT / "boom_twin" / f"{path}.py").is_file(), path


def public_functions() -> dict[str, object]:
    """The stable functions, and the twin's public methods that take something."""
    stable = {name: getattr(boom_twin, name) for name in boom_twin.__all__}
    functions = {name: value for name, value in stable.items() if inspect.isfunction(value)}
    public = {name: value for name, value in vars(stable["Twin"]).items() if name[0] != "_" and inspect.isfunction(value)}
    methods = {f"Twin.{name}": value for name, value in public.items()}
    return functions | {name: value for name, value in methods.items() if len(inspect.signature(value).parameters) > 1}


@pytest.mark.parametrize("name", public_functions())
def test_stable_functions_say_what_they_take_and_give(name: str) -> None:
    function = public_functions()[name]
    text = inspect.getdoc(function) or ""
    head, _, returns = text.partition("\nReturns\n-------\n")
    assert returns.strip()
    parameters = head.partition("\nParameters\n----------\n")[2]
    named = {word for line in re.findall(r"^(\w[\w, ]*) :", parameters, re.MULTILINE) for word in line.split(", ")}
    assert named == set(inspect.signature(function).parameters) - {"self"}


def test_every_stable_name_has_its_place_in_the_reference() -> None:
    """Its description, or a link to the description with its relatives."""
    found = re.findall(r"^(?:::: boom_twin\.|\[`)(\w+)(?:$|`\]\S+ is described)", text_of("docs/api.md"), re.MULTILINE)
    assert sorted(found) == sorted(boom_twin.__all__)
