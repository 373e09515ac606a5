"""Result folders: built beside their place, renamed when whole, replaced only by their own command; marks of incomplete ones.

A command builds a new folder beside ``OUT``: ``OUT.unfinished``, or with a number behind that name if it is taken. In it
``unfinished.json`` names the command. At the end ``manifest.json`` lists every file with its SHA-256, and the folder is
renamed to ``OUT``. A killed command leaves its folder, and no command uses or removes it.

An earlier result must be exactly as its manifest says. It is moved to ``OUT.replaced`` first and removed last. After a kill at
any time one of the two results is whole, and the next run of the command restores its name.
"""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from ..errors import BagError
from .files import real_path, sha256_of, sync_folder, write_atomic

MANIFEST, UNFINISHED = "manifest.json", "unfinished.json"
BUILDING, REPLACED = ".unfinished", ".replaced"  # suffixes of the folders beside the result
OF_THE_SYSTEM = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})  # a file manager leaves them in a folder
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors of a full disk, a full quota, or a file at its size limit. Errors of writing name no file."""


@dataclass(frozen=True, slots=True)
class ResultKind:
    """Kind of result: the command and the files that it writes."""

    command: str
    files: tuple[str, ...]  # patterns for the paths of its files in the folder
    is_replaced: bool
    """True if a later run replaces the result. If not, it is a recording, which has no manifest and is never replaced."""

    def has(self, name: str) -> bool:
        """Return True if a path is one of its files."""
        return any(name.count("/") == each.count("/") and fnmatchcase(name, each) for each in self.files)


_SESSION = ("session_*.mcap", "metadata.yaml", "session.yaml", "truth.csv.gz")
_RESULT_BAG = tuple(
    f"{bag}/{file}" for bag in ("bag", "session") for file in ("session_0.mcap", "metadata.yaml", "session.yaml")
)
_FIGURES = ("summary.json", "quantities.json", "*.png", "report.html", "samples.*")
REPLAY = ResultKind("replay", (*_FIGURES, *_RESULT_BAG), is_replaced=True)
RIG = ResultKind("rig", _SESSION, is_replaced=False)
IMPORT = ResultKind("import", _SESSION, is_replaced=False)
RECOVER = ResultKind("recover", _SESSION, is_replaced=False)
ENVELOPE = ResultKind("envelope", ("envelope.csv", "envelope.json", "envelope.png"), is_replaced=True)
MODAL = ResultKind("modal", ("modes.json", "rest_*.png"), is_replaced=True)
RESPONSE = ResultKind("response", ("response.*", "steady_state.*", "resonance_map.*"), is_replaced=True)


def study(kind: str) -> ResultKind:
    """Return the result kind of a study, whose files all have names that begin with `kind`."""
    return ResultKind(f"study {kind}", (f"{kind}.json", f"{kind}.md", f"{kind}*.png"), is_replaced=True)


@contextmanager
def result_folder(out: Path, kind: ResultKind, sources: Sequence[Path]) -> Iterator[Path]:
    """Build a folder of results, which is renamed to `out` if the block ends without an exception.

    After an exception the new folder is removed, and `out` is unchanged. `out` is missing, empty, or an earlier result of the
    same command. None of the `sources` that the command reads may lie in it, nor it in a session. BagError if `out` holds
    anything else, or it cannot be written.
    """
    place = real_path(out)
    if not place.name or os.path.ismount(place):
        raise BagError(f"{out}: results are built beside it, and it cannot be renamed. Name a folder inside it.")
    if place.exists() and place.samefile(Path.cwd()):
        raise BagError(f"{out}: is the current folder, which would be renamed. Name another, or go up by one.")
    replaced = place.with_name(place.name + REPLACED)
    for folder in (place, replaced):
        _check_sources(out, folder, sources)
    _check_earlier(replaced, kind)
    if replaced.exists() and not place.exists():  # a kill came between the two renames of a replacement
        replaced.rename(place)
    _check_earlier(place, kind)
    _discard(replaced)
    building = _new_folder(place)
    try:
        note = {"command": kind.command, "state": "unfinished; if no such command runs, a run that was stopped left this"}
        (building / UNFINISHED).write_text(json.dumps(note) + "\n")
        yield building
        _complete(building, kind)
    except BaseException as error:
        with suppress(OSError):
            _remove(building, [MANIFEST, *filter(kind.has, _entries(building))])
            (building / UNFINISHED).unlink()
            _remove_empty(building)
        if isinstance(error, OSError) and error.errno in FULL and not error.filename:
            remedy = "Make room on the disk, or choose another place."
            raise BagError(f"{out}: cannot be written ({os.strerror(error.errno)}). {remedy}") from None
        raise
    _put_in_place(out, place, building, replaced, kind)


def _new_folder(place: Path) -> Path:
    """Make a folder beside a result, with a name that is not taken."""
    number, building = 1, place.with_name(place.name + BUILDING)
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        while os.path.lexists(building):
            number += 1
            building = place.with_name(f"{place.name}{BUILDING}{number}")
        building.mkdir()
    except OSError as error:
        raise BagError(f"{building}: cannot be made ({error.strerror}). Choose a folder that can be written.") from None
    return building


def is_unfinished(folder: Path) -> bool:
    """Return True if a folder is marked as unfinished and has no manifest."""
    return (folder / UNFINISHED).is_file() and not (folder / MANIFEST).is_file()


def _check_sources(out: Path, folder: Path, sources: Sequence[Path]) -> None:
    """Refuse a folder that is a source, holds one, lies in one, or has a file to which a link in a source leads.

    Folders are compared by identity, not by spelling. Such a file would be removed with an earlier result.
    """
    for source in sources:
        real = real_path(source)
        session = real if real.is_dir() else real.parent
        is_session = real.is_dir() or (session / "metadata.yaml").is_file()
        if is_session and any(session.samefile(each) for each in (folder, *folder.parents) if each.exists()):
            raise BagError(f"{out}: lies in the source, which is never touched. Choose a folder outside {session}.")
        if folder.exists() and any(folder.samefile(each) for each in (real, *real.parents) if each.exists()):
            raise BagError(f"{out}: {source} lies in {folder}, and a source is never touched. Choose another folder.")
        for file in [source, *(source.iterdir() if source.is_dir() else ())]:
            if file.exists() and folder in (held := file.resolve()).parents:
                told = f"its {held.relative_to(folder)} is {file}"
                raise BagError(f"{folder}: {told}, and a source is never touched. Choose another folder.")


def _check_earlier(folder: Path, kind: ResultKind) -> None:
    if folder.exists() and not folder.is_dir():
        raise BagError(f"{folder}: is no folder. Choose another name.")
    entries = _entries(folder)
    if not entries:
        return
    if not kind.is_replaced:
        raise BagError(f"{folder}: holds {entries[0]} already, and nothing is written over. Choose a new folder.")
    remedy = "Choose a new folder, or move it away: only an earlier result of this command is replaced, as it was written"
    command, listed = _manifest(folder)
    if command != kind.command or listed is None:
        raise BagError(f"{folder}: holds {entries[0]}, and no manifest of `boom_twin {kind.command}`. {remedy}.")
    own = {name for name in listed if kind.has(name)}  # a manifest may come with a recording, and say anything
    folders = {f"{parent}/" for name in own for parent in Path(name).parents}
    for name in entries:
        if name not in own and name not in folders and name not in (MANIFEST, UNFINISHED):
            raise BagError(f"{folder}: holds {name}, which {command} did not write. {remedy}.")
        if name in own and ((folder / name).is_symlink() or sha256_of(folder / name) != listed[name]):
            raise BagError(f"{folder}: {name} was changed since {command} wrote it. {remedy}.")
    for inner in (folder, *(folder / name for name in folders & set(entries))):
        if not inner.stat().st_mode & 0o222:
            raise BagError(f"{inner}: is write-protected. Choose a new folder, or allow to write there.")


def _entries(folder: Path) -> list[str]:
    """Return the paths of all files and folders in a folder, except files of the system. Folders end with a slash."""
    found: list[str] = []
    for place, folders, files in os.walk(folder):
        inside = Path(place).relative_to(folder)
        links = [name for name in folders if (Path(place) / name).is_symlink()]
        found += [(inside / name).as_posix() for name in (*files, *links) if name not in OF_THE_SYSTEM]
        found += [f"{(inside / name).as_posix()}/" for name in folders if name not in links]
    return sorted(found)


def _manifest(folder: Path) -> tuple[str, dict[str, str] | None]:
    """Return the note of a result that is complete or partly removed."""
    return _note(folder / MANIFEST) if (folder / MANIFEST).exists() else _note(folder / UNFINISHED)


def _note(path: Path) -> tuple[str, dict[str, str] | None]:
    """Return command and SHA-256 by file that a manifest states; a marker lists no files, an unreadable note no command."""
    largest_manifest = 2**20  # bytes
    try:
        content = json.loads(path.read_bytes()[:largest_manifest])
        listed = {str(name): str(digest) for name, digest in content["files"].items()} if "files" in content else None
        return str(content["command"]), listed
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return "", None


def _remove(folder: Path, names: Sequence[str]) -> None:
    for name in names:
        (folder / name).unlink(missing_ok=True)
    for inner in reversed([name for name in _entries(folder) if name.endswith("/")]):
        _remove_empty(folder / inner)


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):
        if not _entries(folder):
            for name in OF_THE_SYSTEM:
                (folder / name).unlink(missing_ok=True)
            folder.rmdir()


def _complete(building: Path, kind: ResultKind) -> None:
    files = [name for name in _entries(building) if not name.endswith("/") and name != UNFINISHED]
    for name in files:
        if not kind.has(name):
            raise BagError(f"{building}: holds {name}, which {kind.command} does not write. Move it away, and run it again.")
        with (building / name).open("rb") as stream:
            os.fsync(stream.fileno())
    for folder in {(building / name).parent for name in files}:
        sync_folder(folder)
    content = {"command": kind.command, "files": {name: sha256_of(building / name) for name in files}}
    write_atomic(building / MANIFEST, json.dumps(content, indent=1) + "\n")


def _discard(folder: Path) -> None:
    """Remove an earlier result. Its manifest becomes the marker of an unfinished result and is removed last."""
    try:
        with suppress(FileNotFoundError):
            (folder / MANIFEST).rename(folder / UNFINISHED)
        listed = _manifest(folder)[1] or ()
        _remove(folder, [name for name in _entries(folder) if name in listed])
        (folder / UNFINISHED).unlink(missing_ok=True)
        _remove_empty(folder)
    except OSError as error:
        raise BagError(f"{folder}: the earlier result cannot be removed ({error.strerror}). Remove it by hand.") from None


def _put_in_place(out: Path, place: Path, building: Path, replaced: Path, kind: ResultKind) -> None:
    try:
        _check_earlier(place, kind)  # again: somebody may have put something there meanwhile
        if place.exists():
            place.rename(replaced)
        try:
            building.rename(place)
        except OSError:
            if replaced.exists():
                replaced.rename(place)
            raise
        sync_folder(place.parent)
    except (OSError, BagError) as error:
        reason = str(error) if isinstance(error, BagError) else f"{out}: cannot be replaced ({error.strerror})."
        raise BagError(f"{reason} The result is whole, and is kept in {building}.") from None
    (place / UNFINISHED).unlink()
    if not kind.is_replaced:
        (place / MANIFEST).unlink()
    _discard(replaced)
