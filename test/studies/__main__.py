"""Studies that only the documentation needs: ``PYTHONPATH=test python -m studies papers --out DIR``."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from boom_twin import load_scene


def main(argv: Sequence[str] | None = None) -> None:
    """Write the report, the numbers and the pictures of a study."""
    parser = ArgumentParser(prog="python -m studies", description=__doc__)
    parser.add_argument("kind", choices=("papers", "clearance"))
    parser.add_argument("--out", required=True, type=Path, help="folder; files of this study in it are replaced")
    parser.add_argument("--quick", action="store_true", help="few cases on a short motion")
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    write = import_module(f"studies.{args.kind}.report").write
    for path in write(load_scene(), args.out, args.quick):
        print(path)


if __name__ == "__main__":
    main()
