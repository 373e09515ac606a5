"""A replay whose processes are suspended and go on, as by Ctrl-Z and `fg`, gives what it gives undisturbed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from boom_twin.offline.process_pipe import received

COUNT = 200
SENDER = f"""
import numpy as np
from boom_twin.offline.process_pipe import END, post
for number in range({COUNT}):
    post([np.full(300_000, float(number))])
post([END])
"""


def test_what_a_suspended_process_had_begun_to_write_is_not_lost() -> None:
    """Stopped some 20 times in the midst of objects larger than the pipe."""
    process = subprocess.Popen([sys.executable, "-c", SENDER], stdout=subprocess.PIPE, cwd=Path(__file__).parents[2])
    assert process.stdout is not None
    ended = threading.Event()

    def suspend() -> None:
        while not ended.wait(0.02):
            os.kill(process.pid, signal.SIGSTOP)
            time.sleep(0.02)
            os.kill(process.pid, signal.SIGCONT)

    suspending, found = threading.Thread(target=suspend), []
    try:
        for item in received(process.stdout):
            if not found:
                suspending.start()
            assert (item == item[0]).all()
            found.append(item[0])
            time.sleep(0.003)
    finally:
        ended.set()
        suspending.join()
        process.kill()
    assert found == [float(number) for number in range(COUNT)]
    process.communicate()
