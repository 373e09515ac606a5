"""Calls that a child process carries out."""

import os
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from operator import truediv
from time import sleep

import pytest
from eventually import eventually

from boom_twin import BoomTwinError
from boom_twin.system.child_call import ChildCall

pytestmark = pytest.mark.system


def test_a_call_gives_what_its_function_gives():
    """Results and exceptions come back; what the function prints does not mix with them."""
    divide, write = ChildCall(partial, truediv, 6.0), ChildCall(partial, print)
    assert divide(4.0) == 1.5
    with pytest.raises(ZeroDivisionError):
        divide(0.0)
    assert divide(3.0) == 2.0
    assert write("printed") is None and write("again") is None


def test_a_child_that_ends_is_an_error():
    leave = ChildCall(partial, os._exit)
    for _ in range(2):
        with pytest.raises(BoomTwinError, match="a child process ended with code 3"):
            leave(3)


def test_a_child_gives_way_to_its_parent():
    """Beside a parent that never waits, less than a twentieth of a core is a child's, unless it is urgent."""
    assert ChildCall(partial, os.nice)(0) >= min(os.nice(0) + 14, 19)
    assert ChildCall(partial, os.nice, is_urgent=True)(0) == os.nice(0)


def test_closing_ends_a_child_that_works():
    """A call that lasts ends with an error when another thread closes the child; later calls are errors too."""
    wait = ChildCall(partial, sleep)
    with ThreadPoolExecutor(1) as worker:
        call = worker.submit(wait, 1000.0)
        wait.close()
        with pytest.raises(BoomTwinError, match="ended with code -9"):
            call.result(60.0)
    with pytest.raises(BoomTwinError, match="ended with code -9"):
        wait(0.0)


def test_a_fork_leaves_the_child_alone():
    """A fork of this process has a copy of the object, whose end there neither waits nor ends the child."""
    divide = ChildCall(partial, truediv, 6.0)
    if (fork := os.fork()) == 0:
        divide.close()
        os._exit(0)

    def ended():
        assert os.waitpid(fork, os.WNOHANG)[0] == fork

    eventually(ended, 60.0)
    assert divide(4.0) == 1.5
