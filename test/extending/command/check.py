"""The command is in the help, has a help of its own, does what it is for, and refuses what cannot be used."""

import json
import subprocess
import sys

from boom_twin import load_scene


def run(*words):
    done = subprocess.run([sys.executable, "-m", "boom_twin.cli.main", *words], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


assert "reach how far the boom reaches" in " ".join(run("--help")[1].split())
assert run("reach", "--help")[1].startswith(
    "usage: boom_twin reach [-h] [--quiet] [--scene SCENE] [--json] [SCENE]\n\nHow far the boom reaches."
)
code, printed, _ = run("reach", "--json")
assert code == 0 and json.loads(printed) == {"reach_m": load_scene().reach}
code, _, told = run("reach", "nowhere.yaml")
assert code == 1 and told.startswith("boom_twin reach: nowhere.yaml")
