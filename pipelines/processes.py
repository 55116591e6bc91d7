"""Processes of this machine: when one was started, and ending some with all that they started in turn."""

import signal
import subprocess
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress

import psutil

from assets.formats.file_names import WINDOWS

SAME_S = 2.0
"""Two times of start no further apart are of one process: no system gives a number away again that soon. Chosen by
hand."""
# On Windows only a process that leads a group of its own can be asked to end; elsewhere 0, by definition, asks for
# nothing special.
GROUP: int = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name))
"""Signals besides Ctrl-C that ask a server to end: SIGBREAK is Ctrl-Break, which Windows sends for a closed window."""


def started(pid: int) -> str:
    """Find when a process was started, in seconds, as text; empty where there is none of that number.

    On Linux the seconds count from the start of the machine, so that setting its clock changes nothing; elsewhere,
    where the system itself keeps the time of start, they count from 1970.

    Parameters
    ----------
    pid : int, > 0

    Returns
    -------
    str
        Seconds with two decimals; empty for a process that is gone, or ended and was not waited for.
    """
    try:
        process = psutil.Process(pid)
        if process.status() == psutil.STATUS_ZOMBIE:
            return ""
        at_s = process.create_time() - (psutil.boot_time() if psutil.LINUX else 0.0)
    except (psutil.NoSuchProcess, ValueError, OverflowError):
        return ""
    except psutil.AccessDenied:  # it is there, and is somebody else's
        return "hidden"
    return f"{at_s:.2f}"


def is_running(pid: int, since: str) -> bool:
    """Whether the process of a number is still the one that was started then.

    Parameters
    ----------
    pid : int, > 0
    since : str, as :func:`started` told it

    Returns
    -------
    bool
        False too for another process that has the number now.
    """
    now = started(pid)
    try:
        return abs(float(now) - float(since)) <= SAME_S
    except ValueError:
        return bool(now) and now == since


def end(children: Sequence[subprocess.Popen[bytes]], *, patience_s: float = 10.0) -> None:
    """End processes and all that they started: each is asked first, and what is left then is killed.

    Parameters
    ----------
    children : started with ``creationflags=GROUP``
    patience_s : float, seconds that all of them together have to end by themselves
    """
    left: dict[int, psutil.Process] = {}
    for child in children:
        if child.poll() is None:
            left |= _tree(child.pid)
            _ask(child)
    _wait(left.values(), patience_s)
    for process in list(left.values()):  # some may have started others meanwhile
        left |= _tree(process.pid) if process.is_running() else {}
    for process in left.values():
        with suppress(psutil.NoSuchProcess):
            process.kill()
    _wait(left.values(), patience_s)
    for child in children:
        child.wait()


def _tree(pid: int) -> dict[int, psutil.Process]:
    """Find a process and all that it started, by number; none where it is gone."""
    try:
        process = psutil.Process(pid)
        return {one.pid: one for one in (process, *process.children(recursive=True))}
    except psutil.NoSuchProcess:
        return {}


def _wait(processes: Iterable[psutil.Process], patience_s: float) -> None:
    """Wait until all have ended; those that ended and that nobody waits for count as gone."""
    deadline_s = time.monotonic() + patience_s
    while any(_is_alive(process) for process in processes) and time.monotonic() < deadline_s:
        time.sleep(0.05)


def _is_alive(process: psutil.Process) -> bool:
    try:
        return bool(process.is_running() and process.status() != psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return False


def _ask(child: subprocess.Popen[bytes], *, windows: bool = WINDOWS) -> None:
    """Ask a process to end; Windows has no SIGTERM, there Ctrl-Break says it."""
    if windows:
        child.send_signal(getattr(signal, "CTRL_BREAK_EVENT", signal.SIGINT))
    else:
        child.terminate()
