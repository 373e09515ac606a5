"""Cores that this process may use, and threads of the linear algebra."""

from __future__ import annotations

import os


def usable_cores() -> int:
    """Return the number of cores that this process may use; if the system does not give it, the number of the machine."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def use_one_blas_thread() -> None:
    """Let OpenBLAS work on one thread, unless the environment says otherwise; before numpy is imported.

    Threads slow small matrices down ten times and more, and their number changes the last bits of products of larger ones: a
    live node and a replay of its session must not differ by the computers they ran on. What runs on several cores here does so
    as processes.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
