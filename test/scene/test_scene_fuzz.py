"""Whatever values the default scene is given, loading it gives a scene or a SceneError; its text is damaged in `test/fuzz`."""

from __future__ import annotations

import copy
import math
import warnings
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from boom_twin import SceneError, SceneWarning, load_scene
from boom_twin.scene.summary import explain

Place = tuple[str | int, ...]

TEXTS, NUMBERS = st.text(max_size=8), st.integers(-10, 400) | st.just(10**400) | st.floats() | st.floats(-5, 5)
VALUES = st.recursive(
    st.none() | st.booleans() | NUMBERS | TEXTS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=6,
)


def places(values: Any, at: Place = ()) -> list[Place]:
    """All places of nested values."""
    items = values.items() if isinstance(values, dict) else enumerate(values) if isinstance(values, list) else ()
    return [at, *(place for key, item in items for place in places(item, (*at, key)))]


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
        parent[data.draw(TEXTS)] = data.draw(VALUES)
    elif how == "copy" and isinstance(parent, list):
        parent.append(copy.deepcopy(old))
    else:
        parent[place[-1]] = data.draw(VALUES)


@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data(), count=st.integers(1, 4))
def test_random_edits_give_a_scene_or_a_scene_error(bench: Any, data: st.DataObject, count: int) -> None:
    edited = bench.values()
    for _ in range(count):
        if isinstance(edited, dict) and edited:
            _edit(data, edited)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", SceneWarning)
            scene = load_scene(bench.write(edited))
    except SceneError as error:
        assert error.faults and str(error).startswith(str(bench.path))
    else:
        assert scene.reach > 0.0 and math.isfinite(explain(scene).mass)


def _at(values_now: Any, place: Place) -> Any:
    for step in place:
        values_now = values_now[step]
    return values_now
