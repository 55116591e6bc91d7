"""Dagster's web UI on a studio: the web server and the daemon for sensor and schedule, as one process group.

`dagster dev` started from a script ignores SIGTERM, so both are started here and ended here.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import FrameType

from pipelines import processes
from pipelines.build import end_dead_runs, open_instance
from pipelines.studio.folder import existing


def serve(root: Path, *, host: str, port: int) -> int:
    """Serve until interrupted or until one of the two ends; exit status."""
    studio = existing(root)
    end_dead_runs(open_instance(studio), untagged=True)
    environment = os.environ | {"ODORI_STUDIO": str(studio.root), "DAGSTER_HOME": str(studio.dagster_home.absolute())}
    module = ["-m", "pipelines.definitions"]
    commands = (
        [sys.executable, "-m", "dagster_webserver", "-h", host, "-p", str(port), *module],
        [sys.executable, "-m", "dagster._daemon", "run", *module],
    )
    children = [
        subprocess.Popen(command, env=environment, cwd=studio.root, creationflags=processes.GROUP)
        for command in commands
    ]

    def end(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    for number in processes.ENDING:
        if number == signal.SIGTERM or signal.getsignal(number) != signal.SIG_IGN:  # as nohup leaves it
            signal.signal(number, end)
    sys.stderr.write(f"odori: the studio {studio.root} is at http://{host}:{port}; stop with Ctrl-C\n")
    try:
        while all(child.poll() is None for child in children):
            time.sleep(0.5)
        return next(child.returncode for child in children if child.poll() is not None) or 1
    except KeyboardInterrupt:
        return 0
    finally:
        processes.end(children)
