"""Whatever values the default scene is given, loading it gives a scene or a SceneError; its text is damaged in `test/fuzz`."""

from __future__ import annotations

import copy
import math
import warnings
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from boom_twin.errors import SceneError, SceneWarning
from boom_twin.scene import Scene, load_scene
from boom_twin.scene.summary import explain

Place = tuple[str | int, ...]
SETTINGS = settings(max_examples=30, deadline=None, suppress_health_check=list(HealthCheck))

scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-10, 400),
    st.just(10**400),
    st.floats(),
    st.floats(-5, 5),
    st.text(max_size=8),
)
values = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)


def places(values: Any, at: Place = ()) -> list[Place]:
    """All places of nested values."""
    items = values.items() if isinstance(values, dict) else enumerate(values) if isinstance(values, list) else ()
    return [at, *(place for key, item in items for place in places(item, (*at, key)))]


def outcome(path: Any) -> Scene | SceneError:
    """What loading gives, warnings of the scene being in order and others not."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", SceneWarning)
        try:
            scene = load_scene(path)
        except SceneError as error:
            return error
        return scene


def _edit(data: st.DataObject, values_now: Any) -> None:
    """One random change at a random place: another value, another size, another sign, removed, or added."""
    place = data.draw(st.sampled_from(places(values_now)[1:]))
    parent, old = _at(values_now, place[:-1]), _at(values_now, place)
    how = data.draw(st.sampled_from(["replace", "scale", "nudge", "remove", "add", "copy"]))
    if how in ("scale", "nudge") and isinstance(old, float):
        parent[place[-1]] = old * data.draw(st.floats(-1e3, 1e3) if how == "scale" else st.floats(0.8, 1.2))
    elif how == "remove":
        del parent[place[-1]]
    elif how == "add" and isinstance(parent, dict):
        parent[data.draw(st.text(max_size=8))] = data.draw(values)
    elif how == "copy" and isinstance(parent, list):
        parent.append(copy.deepcopy(old))
    else:
        parent[place[-1]] = data.draw(values)


@SETTINGS
@given(data=st.data(), count=st.integers(1, 4))
def test_random_edits_give_a_scene_or_a_scene_error(bench: Any, data: st.DataObject, count: int) -> None:
    edited = bench.values()
    for _ in range(count):
        if isinstance(edited, dict) and edited:
            _edit(data, edited)
    result = outcome(bench.write(edited))
    if isinstance(result, SceneError):
        assert len(result.faults) > 0
        assert str(result).startswith(str(bench.path))
    else:
        account = explain(result)
        assert account.length == sum(section.length for section in result.sections)
        assert math.isfinite(account.mass)


@SETTINGS
@given(data=st.data(), count=st.integers(1, 4))
def test_slight_changes_of_numbers_give_a_scene_or_a_scene_error(bench: Any, data: st.DataObject, count: int) -> None:
    edited = bench.values()
    numbers = [place for place in places(edited) if isinstance(_at(edited, place), float)]
    for place in data.draw(st.lists(st.sampled_from(numbers), min_size=count, max_size=count)):
        _at(edited, place[:-1])[place[-1]] = _at(edited, place) * data.draw(st.floats(0.9, 1.1))
    result = outcome(bench.write(edited))
    if isinstance(result, Scene):
        assert 0 < explain(result).mass < 2 * explain(load_scene()).mass


def _at(values_now: Any, place: Place) -> Any:
    for step in place:
        values_now = values_now[step]
    return values_now
