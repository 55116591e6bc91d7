"""Processes: which one a number means, and that none is left."""

import os
import subprocess
import sys
import textwrap
import time

import psutil
import pytest

from pipelines import processes


@pytest.fixture
def sleeper():
    """A process that waits, killed at the end."""
    process = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    yield process
    process.kill()
    process.wait()


def test_a_process_is_known_by_when_it_was_started(sleeper):
    since = processes.started(sleeper.pid)
    assert float(since) > 0
    assert processes.is_running(sleeper.pid, since)
    assert processes.started(sleeper.pid) == since
    assert float(since) - float(processes.started(os.getpid())) >= 0


def test_a_number_used_again_is_not_taken_for_the_process(sleeper):
    since = float(processes.started(sleeper.pid))
    assert not processes.is_running(sleeper.pid, f"{since - 60:.2f}")
    assert not processes.is_running(sleeper.pid, "")
    assert not processes.is_running(sleeper.pid, "alive")


def test_another_process_reads_the_same_time(sleeper):
    code = f"from pipelines import processes; print(processes.started({sleeper.pid}))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
    assert told == processes.started(sleeper.pid)


def test_what_ended_is_gone_also_while_nobody_has_waited_for_it():
    process = subprocess.Popen([sys.executable, "-c", ""])
    since = processes.started(process.pid)
    psutil.Process(process.pid)  # it is still listed
    while psutil.Process(process.pid).status() != psutil.STATUS_ZOMBIE:
        time.sleep(0.01)
    assert processes.started(process.pid) == ""
    assert not processes.is_running(process.pid, since)
    process.wait()
    assert processes.started(process.pid) == ""


@pytest.mark.parametrize("pid", [2**22 + 1, 2**40])
def test_a_number_nobody_has(pid):
    assert processes.started(pid) == ""
    assert not processes.is_running(pid, "1.00")


STUBBORN = textwrap.dedent(
    """
    import signal, subprocess, sys, time
    {ignore}
    code = "import signal, time; {ignore}; print(1, flush=True); time.sleep(60)"
    inner = subprocess.Popen([sys.executable, "-c", code])
    print(inner.pid, flush=True)
    time.sleep(60)
    """
)


@pytest.mark.parametrize("ignore", ["pass", "signal.signal(signal.SIGTERM, signal.SIG_IGN)"])
def test_nothing_is_left_of_what_children_started(ignore):
    code = STUBBORN.format(ignore=ignore)
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, creationflags=processes.GROUP)
    lines = [child.stdout.readline(), child.stdout.readline()]  # both are up: in which order, who knows
    grandchild = psutil.Process(max(int(line) for line in lines))
    processes.end([child], patience_s=1.0)
    assert child.returncode != 0
    assert not grandchild.is_running() or grandchild.status() == psutil.STATUS_ZOMBIE
    child.stdout.close()


def test_ending_what_has_ended_is_no_trouble():
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    processes.end([child])
    assert child.returncode == 0
    processes.end([])


def test_windows_is_asked_by_ctrl_break():
    class Child:
        said = None

        def send_signal(self, number):
            self.said = number

    child = Child()
    processes._ask(child, windows=True)
    assert child.said is not None
