"""Target ``scenes``: damaged scene files through load, check, statics and a short simulation.

Silent is a scene that is not what its file says: the start of a known file taken for the whole of it, a value that another
reading of the same YAML gives otherwise, a result that is not a number.
"""

from __future__ import annotations

import json
import warnings
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from default_boom import strokes_of_posture
from numpy.random import Generator
from ruamel.yaml import YAML
from ruamel.yaml.constructor import DuplicateKeyError
from ruamel.yaml.error import YAMLError

from boom_twin import BoomTwinError, Scene, SceneError, SceneWarning, load_scene, simulate, statics
from boom_twin.scene.load import NUMBER

from .mutate import cut, damaged, pick, rearranged
from .odd_yaml import odd
from .verdict import Kind, Verdict, printed

SUFFIX = ".yaml"
ROWS, SPAN = 6, 0.05  # of the short simulation, s


@cache
def bases() -> dict[str, str]:
    """Whole scenes: as packaged, with clearance, with five sections, with mirrored linkages and oil."""
    text, example = printed("scene")[1], printed("scene", "--example", "five_section_z_fold")[1]
    return {"default": text, "clearance": printed("scene", "--clearance")[1], "five": _five(text), "z fold": example}


def _five(text: str) -> str:
    """The default scene with its third section and last joint twice."""
    lines = text.splitlines(keepends=True)
    section = next(i for i, line in enumerate(lines) if line.startswith("  - {length: 3.20"))
    joint = next(i for i, line in enumerate(lines) if line.startswith("  - {kind: B3"))
    more = {section + 1: "".join(lines[section : section + 2]), joint + 2: "".join(lines[joint : joint + 3])}
    angles = {"horizontal": 0, "arch": -110, "high": 0, "low": -120}
    rows = [line + more.get(i, "") for i, line in enumerate(lines)]
    for name, angle in angles.items():
        rows = [row.replace("]", f", {angle}]") if row.startswith(f"  {name}: [") else row for row in rows]
    return "".join(rows)


def make(random: Generator, path: Path) -> Path:
    """Write a damaged scene to `path` with the suffix of scenes."""
    text = str(pick(random, list(bases().values())))
    if random.random() < 0.3:
        data = pick(random, (cut, damaged, damaged))(random, text.encode())
    else:
        for _ in range(int(random.integers(1, 4))):
            text = odd(random, text) if random.random() < 0.75 else rearranged(random, text)
        data = text.encode("utf-8", "surrogatepass")
    path = path.with_suffix(SUFFIX)
    path.write_bytes(data)
    return path


def judge(path: Path) -> Verdict:
    """Load, check and compute."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("error")
        warnings.simplefilter("always", SceneWarning)
        try:
            scene = load_scene(path)
        except SceneError as error:
            scene, verdict = None, _refused(str(error), path)
    code, words = printed("check", str(path))
    assert code == (scene is None), f"check ends with {code}: {words}"
    if scene is None:
        return verdict
    if any(scene == _base(name) for name in bases()):
        return Verdict(Kind.EQUAL)
    doubt = ("" if told else _start_of_another(path)) or _unlike_file(path, scene) or _wrong_results(scene)
    if doubt:
        return Verdict(Kind.SILENT, doubt)
    return Verdict(Kind.TOLD, str(told[0].message)) if told else Verdict(Kind.OTHER)


@cache
def _base(name: str) -> Scene:
    return _load_text(bases()[name], Path(f"{name}{SUFFIX}"))


def _load_text(text: str, path: Path) -> Scene:
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)
        (Path(folder) / path.name).write_text(text, encoding="utf-8")
        return load_scene(Path(folder) / path.name)


def _refused(words: str, path: Path) -> Verdict:
    """A refusal that names the file and the place."""
    is_clear = words.startswith(str(path)) and words.splitlines()[1:]
    return Verdict(Kind.REFUSED, words) if is_clear else Verdict(Kind.TRACEBACK, f"refused without place: {words!r}")


def _start_of_another(path: Path) -> str:
    """Of which scene the file is the start, if it is cut off; empty otherwise."""
    data = path.read_bytes()
    for name, text in bases().items():
        if text.encode().startswith(data):
            return f"the first {len(data)} of {len(text)} bytes of the {name} scene are taken for a whole one"
    return ""


def _unlike_file(path: Path, scene: Scene) -> str:
    """In what the scene is not what its file says; empty if nothing."""
    try:
        values = YAML(typ="safe", pure=True).load(path.read_bytes().decode("utf-8-sig"))
    except DuplicateKeyError as error:
        return f"a key is there twice: {error.problem}"
    except (YAMLError, ValueError, TypeError):  # of tags that the loader reads as text
        return ""
    try:
        again = _load_text(json.dumps(_plain(values), default=str), path)
    except SceneError as error:
        return f"the same values are refused when written as JSON: {error}"
    return "" if again == scene else "the same values written as JSON give another scene"


def _plain(value: Any) -> Any:
    """Values as JSON has them, numbers that YAML takes for text among them."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return float(value) if isinstance(value, str) and NUMBER.fullmatch(value) else value


def _wrong_results(scene: Scene) -> str:
    """What the results at the scene's first posture are wrong in; empty if nothing, or if they are refused."""
    name = next(iter(scene.postures), None)
    try:
        if name is None:
            strokes = np.array([joint.cylinder.max_stroke / 2 for joint in scene.joints])
            rest = statics(scene, strokes)
        else:
            strokes = strokes_of_posture(scene, name)
            rest = statics(scene, posture=name)
        moved = simulate(scene, np.linspace(0.0, SPAN, ROWS), np.tile(strokes, (ROWS, 1)), dt=SPAN / ROWS)
    except BoomTwinError as error:
        words = str(error)
        return "" if words and "\n" not in words else f"not refused in one line: {words!r}"
    numbers = (rest.tip, rest.joints, rest.cylinder_forces, rest.frequencies, *moved.columns().values())
    return "" if all(np.isfinite(each).all() for each in numbers) else "results hold what is not a number, without a word"


@cache
def begin() -> None:
    """Compile, and make what all cases are compared with."""
    for name in bases():
        _wrong_results(_base(name))
