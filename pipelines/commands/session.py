"""A studio opened for work by a command: held, tidied, its definitions loaded."""

import difflib
from collections.abc import Callable, Container, Iterable
from typing import Any

from sqlalchemy.exc import DBAPIError

from assets.dancing.methods import METHODS
from assets.formats.errors import FormatError
from assets.motion import beat_settings
from assets.stamps import Progress
from kernels.skeleton.canonical import JOINTS
from pipelines import build
from pipelines.collection import freshness
from pipelines.definitions import build_definitions
from pipelines.device_fallback import DeviceError, Devices, to_standard_error
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder
from schemas.keys import base_method


class Session:
    """A studio opened for work: held, tidied, its definitions loaded."""

    def __init__(self, studio: StudioFolder, progress: Callable[[], Any]) -> None:
        self.studio = studio
        self.notes: list[str] = []
        """Lines shown to the person who waits: which device failed, what is slow and why."""
        self.devices = Devices(studio.settings().opencl.device, say=self._say)
        check_settings(studio, self.devices)
        self.state = freshness(studio)
        self._progress = progress

    def run(
        self,
        groups: Iterable[str],
        *,
        keys: Callable[[str, str], bool] | None = None,
        assets: Container[str] | None = None,
    ) -> build.Report:
        """Bring groups of assets, or some assets of them, up to date."""
        bar: Progress = self._progress()
        try:
            with build.exclusive(self.studio):
                instance = build.open_instance(self.studio)
                build.clear_after_kill(self.studio, instance)
                definitions = build_definitions(self.studio, progress=bar, devices=self.devices)
                return build.bring_up_to_date(
                    self.studio,
                    definitions.resolve_job_def,
                    instance,
                    self.state,
                    groups=groups,
                    keys=keys,
                    assets=assets,
                )
        except DBAPIError as error:  # what was stored before is whole: tables are written beside and renamed
            place = self.studio.dagster_home
            raise StudioError(
                f"{place}: Dagster's storage refused: {error.orig}; free some space or mend it"
            ) from error
        finally:
            if hasattr(bar, "close"):
                bar.close()

    def run_before_dance(self, song: str, method: str) -> build.Report:
        """Bring up to date what a dance of a song is chosen from, and not the dance.

        Parameters
        ----------
        song : key
        method : name of a method of dancing
        """
        key = f"{song}|{method}"
        self.state.prepare(key)
        needed = {name for name in self.state.needed_for(key) if self.state.assets[name].kind != "dance"}
        songs = {song} | (self.state.sources.performed_songs if METHODS[base_method(method)].learns else set())
        return self.run(build.GROUPS, keys=lambda kind, one: kind != "song" or one in songs, assets=needed)

    def _say(self, line: str) -> None:
        self.notes.append(line)
        to_standard_error(line)


def check_settings(studio: StudioFolder, devices: Devices) -> None:
    """Refuse settings before anything runs; FormatError naming the key."""
    settings = studio.settings()
    try:
        beat_settings(settings.motion_beat)
    except ValueError as error:
        raise FormatError("odori.toml", 0, f"[motion_beat] {error}") from error
    for source, joint in settings.joints.items():
        if joint not in JOINTS:
            near = difflib.get_close_matches(joint, JOINTS, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"they are {', '.join(JOINTS)}"
            raise FormatError("odori.toml", 0, f"[joints] {source!r}: want a canonical joint, got {joint!r}; {hint}")
    if settings.opencl.device:
        try:
            devices.in_use()
        except DeviceError as error:
            raise FormatError("odori.toml", 0, str(error.args[0])) from error
