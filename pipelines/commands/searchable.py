"""What a search needs made first: clips read, the encoder trained, embeddings and index up to date."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pipelines.commands.session import Session
from pipelines.studio.files import StudioError
from pipelines.studio.folder import existing
from schemas.search import MOTION_ENCODER

_GROUPS = ("capture", "motion", "search")


def make_searchable(root: Path, *, train: bool, progress: Callable[[], Any]) -> None:
    """Bring the search index of a studio up to date.

    Parameters
    ----------
    root : the studio
    train : train the encoder anew, whatever there is
    progress : makes the bar of long steps

    Raises
    ------
    StudioError
        If there is no clip, or something a search needs could not be made.
    """
    studio = existing(root)
    work = Session(studio, progress)
    if not work.state.sources.clips:
        raise StudioError(f"{root}: want clips under clips/, got none; put some there")
    if train:
        studio.lake.remove(MOTION_ENCODER.name, "")
    work.state.ask("search")
    needed = {n.name for n in work.state.assets.values() if n.group == "search"}
    for node in reversed(list(work.state.assets.values())):
        if node.name in needed:
            needed |= {*node.inputs, *node.together}
    report = work.run(_GROUPS, assets=needed)
    failed = [t for t in report.failed]
    if failed and not studio.lake.keys("motion_index"):
        raise StudioError(failed[0])
