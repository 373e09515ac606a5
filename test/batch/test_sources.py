"""Which sessions are meant: paths, globs, lists."""

from __future__ import annotations

from pathlib import Path

import pytest

from boom_twin import UsageError
from boom_twin.batch.folder import fingerprint, key_of, sessions_of


@pytest.fixture
def there(tmp_path: Path) -> Path:
    for name in ("a", "b", "c"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "session_0.mcap").write_bytes(b"x")
    (tmp_path / "empty").mkdir()
    (tmp_path / "notes.md").write_text("x")
    return tmp_path


def test_globs_and_paths_give_each_session_once(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert sessions_of([str(there / "*")]) == [there / "a", there / "b", there / "c"]
    given = [str(there / "b"), str(there / "[ab]"), str(there / "nothing")]
    assert sessions_of(given) == [there / "b", there / "a", there / "nothing"]
    monkeypatch.chdir(there)
    assert sessions_of(["[ab]"]) == [Path("a"), Path("b")]


def test_a_glob_that_fits_nothing_is_refused(there: Path) -> None:
    with pytest.raises(UsageError, match="fits no session"):
        sessions_of([str(there / "x*")])


def test_keys_and_fingerprints_tell_sessions_and_changes_apart(there: Path) -> None:
    (there / "d").mkdir()
    (there / "d" / "a").mkdir()
    assert key_of(there / "a") != key_of(there / "d" / "a") and key_of(there / "a") == key_of(there / "b" / ".." / "a")
    before = fingerprint(there / "a", "options")
    assert before == fingerprint(there / "a", "options") != fingerprint(there / "a", "others")
    (there / "a" / "session_0.mcap").write_bytes(b"xy")
    assert fingerprint(there / "a", "options") != before


def test_links_that_lead_in_a_circle_are_no_sessions_and_no_end(there: Path) -> None:
    """Two of them: a search that follows both meets 2^40 folders."""
    for name in ("one", "two"):
        (there / "a" / name).symlink_to(there)
    (there / "to_itself.mcap").symlink_to("to_itself.mcap")
    (there / "linked").symlink_to(there / "b")
    found = [there / name / "session_0.mcap" for name in ("a", "b", "c")]
    assert sessions_of([str(there / "**" / "*.mcap")]) == [*found, there / "to_itself.mcap"]
    assert there / "a" in sessions_of([str(there / "**")])
    assert fingerprint(there / "to_itself.mcap", "") and key_of(there / "to_itself.mcap").startswith("to_itself-")
