"""``boom_twin warm``: compile the kernels beforehand, or remove the compiled kernels."""

from __future__ import annotations

import shutil
import time
from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..errors import UsageError
from .output import tell


def add_arguments(parser: ArgumentParser) -> None:
    purpose = "remove the compiled kernels of all versions; the next command that needs them compiles anew"
    parser.add_argument("--remove", action="store_true", help=purpose)


def run(args: Namespace) -> int:
    """Compile or load all that node, replay and statics need, or remove it; say where it is and how large."""
    from ..kernels.compiled_cache import SUFFIX, all_caches, cache_folder, cache_root, fault_of

    if args.remove:
        found = all_caches()
        size = sum(map(_size, found))
        for each in found:
            shutil.rmtree(each)
        print(f"removed {len(found)} folders of compiled kernels, {size:.1f} MB, from {cache_root()}")
        return 0
    folder = cache_folder()
    if (fault := fault_of(folder)) is not None:
        raise UsageError(f"compiled kernels cannot be kept: {fault}")
    from ..config.settings import Settings
    from ..messages.report_encoder import ReportEncoder
    from ..scene.load import load_scene
    from ..twin.twin import Twin

    before, began = len(list(folder.glob(f"*{SUFFIX}"))), time.perf_counter()
    if not before:
        tell("compiling the kernels of node, replay and statics with numba, one at a time: 40 s to some minutes ..")
    scene = load_scene()
    Twin(scene, health=True).warm_up()
    ReportEncoder(scene, Settings())  # compiles the kernel of its numbers
    kernels = len(list(folder.glob(f"*{SUFFIX}")))
    told = f"{kernels - before} compiled now" if kernels > before else "nothing to compile"
    print(f"{kernels} kernels in {folder}, {_size(folder):.1f} MB; {told}, {time.perf_counter() - began:.1f} s")
    return 0


def _size(folder: Path) -> float:
    return sum(each.stat().st_size for each in folder.iterdir()) / 1e6
