"""A progress bar on standard error."""

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn


class Bar:
    """One bar at a time: a new step replaces the last; see :class:`assets.stamps.Progress`."""

    def __init__(self) -> None:
        self._shown = Progress(
            TextColumn("{task.description:20}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        self._shown.start()

    def begin(self, what: str, total: int) -> None:
        """Start counting."""
        for task in self._shown.task_ids:
            self._shown.remove_task(task)
        self._shown.add_task(what, total=total)

    def step(self) -> None:
        """One more is done."""
        for task in self._shown.task_ids:
            self._shown.advance(task)

    def close(self) -> None:
        """Take the bar away."""
        self._shown.stop()
