"""Broken, hostile and absurd input, at random: ``PYTHONPATH=test python -m fuzz.run [--seconds 600] [--seed 1]``.

Two workers judge cases at a time; this process ends one that hangs, counts it, and starts another behind that case. What is not
wanted is kept in ``--out``, with the command that repeats it: ``python -m fuzz.run --target NAME --case PATH``.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from selectors import EVENT_READ, DefaultSelector
from shutil import rmtree

from .verdict import Kind, Verdict, table
from .worker import LONGEST, TARGETS, judged, make, module

ROOT = Path(__file__).parents[2]
SHARES = {"scenes": 0.35, "bags": 0.3, "messages": 0.25, "page": 0.1}
WORKERS = 2
LONGEST_WAIT = 180.0
"""Seconds of the clock: a case that waits for nothing takes no processor. The machine may have other work."""
START = 300.0
"""Seconds in which a worker begins: it may compile."""
LOOK = 0.25
TICKS = os.sysconf("SC_CLK_TCK")


@dataclass
class Findings:
    """What was not wanted, with the words of each."""

    seed: int
    out: Path
    counts: dict[str, Counter[str]] = field(default_factory=dict)
    cases: list[tuple[str, int, Verdict]] = field(default_factory=list)

    def count(self, target: str, number: int, verdict: Verdict) -> None:
        """Count a case; keep it if it is a finding."""
        self.counts.setdefault(target, Counter())[verdict.kind] += 1
        if not verdict.is_finding:
            return
        self.cases.append((target, number, verdict))
        folder = self.out / f"{target}_{self.seed}_{number}"
        rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        command = f"PYTHONPATH=test python -m fuzz.run --target {target} --case {make(target, self.seed, number, folder)}"
        (folder / "finding.txt").write_text(f"{verdict.kind}\n{command}\n{verdict.words}\n", encoding="utf-8")
        print(f"{verdict.kind}: {command}\n  {_last_line(verdict.words)}", file=sys.stderr)


def _last_line(words: str) -> str:
    return (words.strip().splitlines() or [""])[-1][:300]


class Worker:
    """One process that judges every `WORKERS`-th case of a target, begun anew behind a case that ended it.

    Parameters
    ----------
    target : str
    place : int
        Of this worker among all: its first case.
    findings : Findings
    folder : Path
        For the cases while they are judged.
    """

    def __init__(self, target: str, place: int, findings: Findings, folder: Path) -> None:
        self._target, self._findings, self._folder = target, findings, folder
        self._number, self._last_words = place, ""
        self._begin()

    def _begin(self) -> None:
        numbers = map(str, (self._findings.seed, self._number, WORKERS))
        command = [sys.executable, "-m", "fuzz.worker", self._target, *numbers, str(self._folder)]
        path = {**os.environ, "PYTHONPATH": str(ROOT / "test")}
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - closed by end()
        self._process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=self._log, cwd=ROOT, env=path, start_new_session=True
        )
        assert self._process.stdout is not None
        self.stream = self._process.stdout
        self._since, self._busy, self._is_at_case = time.monotonic(), 0.0, False

    def read(self) -> None:
        """Take one line of it, or begin anew where it has ended."""
        line = self.stream.readline()
        if not line:
            self._process.wait()
            self._log.seek(0)
            words = self._log.read().decode(errors="replace")[-3000:]
            if not self._is_at_case:
                raise SystemExit(f"{self._target}: the worker does not begin\n{words}")
            self._give_up(Verdict(Kind.TRACEBACK, f"the process ended with {self._process.returncode}\n{words}"))
            return
        told = json.loads(line)
        if "kind" in told:
            self._findings.count(self._target, told["number"], Verdict(Kind(told["kind"]), told["words"]))
            self._number, self._is_at_case = told["number"] + WORKERS, False
        else:
            self._is_at_case = True
        self._since, self._busy = time.monotonic(), self._processor()

    def look(self) -> None:
        """End it where a case takes too long."""
        waited = time.monotonic() - self._since
        if not self._is_at_case:
            if waited > START:
                raise SystemExit(f"{self._target}: the worker does not begin")
        elif (took := self._processor() - self._busy) > 2 * LONGEST or waited > LONGEST_WAIT:
            self._give_up(Verdict(Kind.HANG, f"{took:.0f} s of a processor, {waited:.0f} s of the clock"))

    def _give_up(self, verdict: Verdict) -> None:
        self.end()
        self._findings.count(self._target, self._number, verdict)
        self._number += WORKERS
        self._begin()

    def _processor(self) -> float:
        """Seconds of a processor that it and all that it started have taken."""
        total = 0
        for file in Path("/proc").glob("[0-9]*/stat"):
            try:
                fields = file.read_text(errors="replace").rpartition(")")[2].split()
            except OSError:  # ended meanwhile
                continue
            if int(fields[3]) == self._process.pid:  # session
                total += sum(map(int, fields[11:15]))
        return total / TICKS

    def end(self) -> None:
        """End it and all that it started."""
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self.stream.close()
        self._log.close()


def fuzz(target: str, seconds: float, findings: Findings) -> None:
    """Judge cases of one target for so long; the time counts from the first verdict."""
    findings.counts.setdefault(target, Counter())
    with tempfile.TemporaryDirectory(prefix="boom_twin_fuzz_") as folder:
        workers = [Worker(target, place, findings, Path(folder)) for place in range(WORKERS)]
        try:
            end = None
            while end is None or time.monotonic() < end:
                with DefaultSelector() as selector:
                    for worker in workers:
                        selector.register(worker.stream, EVENT_READ, worker)
                    for key, _ in selector.select(LOOK):
                        key.data.read()
                for worker in workers:
                    worker.look()
                if end is None and findings.counts[target]:
                    end = time.monotonic() + seconds
        finally:
            for worker in workers:
                worker.end()


def main() -> int:
    """Fuzz, print the table; 1 if there was a finding."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--target", nargs="+", choices=TARGETS, default=list(TARGETS))
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "fuzz", help="where findings are kept")
    parser.add_argument("--case", type=Path, help="judge this one of --target, in this process")
    args = parser.parse_args()
    if args.case is not None:
        module(args.target[0]).begin()
        verdict = judged(args.target[0], args.case)
        print(f"{verdict.kind}: {verdict.words}")
        return int(verdict.is_finding)
    findings = Findings(args.seed, args.out)
    for target in args.target:
        fuzz(target, args.seconds * SHARES[target] / sum(SHARES[each] for each in args.target), findings)
    print(table(findings.counts))
    return int(bool(findings.cases))


if __name__ == "__main__":
    sys.exit(main())
