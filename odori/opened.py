"""A studio opened in Python: what ``odori build``, ``dance``, ``search`` and ``why`` do, on what it holds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING

from threadpoolctl import threadpool_limits

from odori import inputs
from odori.answers import CatalogueClip, CatalogueSong, SearchHit
from odori.exceptions import DanceRefusedError, OdoriError, refused
from odori.holdings import Holdings
from odori.made_dances import FrameOrigin, MadeDance, PinProposal, explain_frame
from pipelines.caches import settle
from pipelines.studio.folder import StudioFolder, existing

if TYPE_CHECKING:
    from odori.drafts import DraftRoom
    from odori.made_dances import Draft


def open(folder: str | PathLike[str] = "studio") -> OpenStudio:
    """Open a studio: a folder with ``clips/`` and ``songs/`` in it.

    Parameters
    ----------
    folder : path; nothing is built or changed

    Returns
    -------
    OpenStudio

    Raises
    ------
    OdoriError
        If there is no such folder, or it cannot be read.

    Examples
    --------
    >>> import odori
    >>> folder = odori.demo().root
    >>> studio = odori.open(folder)
    >>> len(studio.songs)
    3

    See Also
    --------
    demo : a studio to try things in
    """
    return _opened(folder)


def _opened(folder: str | PathLike[str]) -> OpenStudio:
    settle()
    with refused():
        return OpenStudio(existing(inputs.path("folder", folder)))


def demo(folder: str | PathLike[str] = "demo") -> OpenStudio:
    """Make up a studio and build it: three dancers, one in a suit, a performer, and three songs; no input needed.

    Parameters
    ----------
    folder : a new folder, or that of an earlier demo, which is brought up to date

    Returns
    -------
    OpenStudio

    Raises
    ------
    OdoriError
        If the folder holds something else.

    Examples
    --------
    >>> import odori
    >>> odori.demo().songs.keys()
    ['drum_machine', 'drum_machine_mid', 'hidden_rules']

    See Also
    --------
    open : a studio of your own
    """
    from pipelines.commands import demo_studio

    with refused():
        demo_studio.make(inputs.path("folder", folder))
    studio = _opened(folder)
    studio.build()
    return studio


@dataclass(frozen=True)
class BuildReport:
    """What a build came to.

    Parameters
    ----------
    n_clips, n_songs : how many can be read
    refused : of each file that cannot, its path and why
    n_made : partitions of tables that were made; 0 where everything was up to date
    failed : what could not be made, one sentence each
    notes : what was odd, one sentence each
    """

    n_clips: int
    n_songs: int
    refused: dict[str, str]
    n_made: int
    failed: tuple[str, ...]
    notes: tuple[str, ...]


_WHERE = re.compile(r"^failed: \[[^\]]*\] \w+: ")
"""Which partition of which table a command says that a failure is of."""


class OpenStudio(Holdings):
    """A studio on disk; made by :func:`odori.open`.

    What a build or a dance writes is what ``odori build`` and ``odori dance`` write, to the byte.

    Parameters
    ----------
    folder : StudioFolder

    Examples
    --------
    >>> import odori
    >>> studio = odori.demo()
    >>> studio
    <odori studio demo: 50 clips, 3 songs>

    See Also
    --------
    odori.open
    """

    def __init__(self, folder: StudioFolder) -> None:
        super().__init__(folder)
        self._room: DraftRoom | None = None

    def __repr__(self) -> str:
        try:
            return f"<odori studio {self.root.name}: {len(self.clips)} clips, {len(self.songs)} songs>"
        except OdoriError:  # settings that are none: reading them says which
            return f"<odori studio {self.root.name}>"

    def build(self, *, dances: bool = False) -> BuildReport:
        """Bring everything up to date, as ``odori build``: only what changed is computed.

        Parameters
        ----------
        dances : also make dances again that are stale

        Returns
        -------
        BuildReport

        Raises
        ------
        OdoriError
            If nothing could be done: no files, settings that are none, a full disk, another build at work.

        Examples
        --------
        >>> import odori
        >>> report = odori.demo().build()
        >>> report.n_clips, report.n_songs, report.refused
        (50, 3, {})

        See Also
        --------
        dance : builds what it needs
        """
        from pipelines.commands.build_studio import build_studio
        from pipelines.resources import NoProgress

        with refused(), threadpool_limits(limits=1):
            done = build_studio(self.root, dances=dances, progress=NoProgress)
        facts = done.facts
        if done.status == 2:
            raise OdoriError("; ".join(done.troubles) or "nothing could be built")
        return BuildReport(
            facts["clips"]["read"],
            facts["songs"]["read"],
            {file["path"]: file["reason"] for file in facts["refused"]},
            sum(len(batch["partitions"]) for batch in facts["ran"]),
            tuple(facts["failed"]),
            tuple(facts["notes"]),
        )

    def dance(
        self,
        song: str | CatalogueSong,
        *,
        method: str | None = None,
        pins: Sequence[str] = (),
        frame_rate_hz: float | None = None,
        out: str | PathLike[str] | None = None,
        alternatives: int = 1,
        character: str = "",
        temperature: float | None = None,
        seed: int = 0,
    ) -> MadeDance:
        """Dance a song and write its USD stage, as ``odori dance``; what it needs is built first.

        Parameters
        ----------
        song : its key, or the name of its file
        method : ``graph``, ``matching`` or ``hmm``; None for the one its brief names
        pins : what to dance when, as typed: ``12-16=spin``, ``bar:9-12=style:salsa``
        frame_rate_hz : of the stage, 1 to 240; None for the setting's
        out : where to copy the stage, ``.usdz`` or ``.usdc``
        alternatives : how many different dances to make; the first is returned, all are in :attr:`dances`
        character : clip or USD file whose body dances
        temperature, seed : of ``hmm``: 0 for the most probable dance, 1 for one drawn as the dancer would

        Returns
        -------
        MadeDance

        Raises
        ------
        DanceRefusedError
            If the pins cannot all be kept (``conflict``, ``ways_out``), or there is nothing to dance.
        OdoriError
            If there is no such song, method or pin.

        Examples
        --------
        >>> import odori
        >>> studio = odori.demo()
        >>> dance = studio.dance("drum_machine", pins=["8-12=kick"])
        >>> dance.pins[0]["is_kept"]
        True
        >>> dance.quality["beat_f_ratio"] > 0.5
        True

        See Also
        --------
        draft : without writing a stage
        propose : what could be pinned
        why : where a moment comes from
        """
        from pipelines.commands.dance_songs import dance_songs
        from pipelines.resources import NoProgress

        row = self._song(song)
        with refused(), threadpool_limits(limits=1):
            done = dance_songs(
                self.root,
                [row.song_id],
                method=None if method is None else inputs.key("method", method),
                frame_rate_hz=_rate(frame_rate_hz),
                out=None if out is None else inputs.path("out", out),
                progress=NoProgress,
                pins=inputs.texts("pins", pins),
                alternatives=inputs.count("alternatives", alternatives),
                character=inputs.key("character", character) if character else "",
                temperature=_temperature(temperature),
                seed=inputs.count("seed", seed, least=0),
            )
        if done.status == 2:
            facts = done.facts
            reason = _WHERE.sub("", str(facts.get("error") or "; ".join(done.troubles)))
            raise DanceRefusedError(reason, conflict=facts.get("conflict", ()), ways_out=facts.get("ways_out", ()))
        first = done.facts["dances"][0] if "dances" in done.facts else done.facts
        return MadeDance(self._folder, f"{first['song']}|{first['method']}")

    def draft(
        self,
        song: str | CatalogueSong,
        *,
        method: str | None = None,
        pins: Sequence[str] = (),
        frame_rate_hz: float | None = None,
        temperature: float | None = None,
        seed: int = 0,
    ) -> Draft:
        """Choose a dance and assemble its poses in memory: nothing is written, and no stage is made.

        Uses the catalogue as it stands; what is not there at all is built first.

        Parameters
        ----------
        song, method, pins, frame_rate_hz, temperature, seed : as :meth:`dance`

        Returns
        -------
        Draft
            The steps and the poses that :meth:`dance` would write.

        Raises
        ------
        DanceRefusedError, OdoriError
            As :meth:`dance`.

        Examples
        --------
        >>> import odori
        >>> draft = odori.demo().draft("drum_machine", pins=["8-12=kick"])
        >>> draft.steps["song_end_s"][-1] > 30
        True
        >>> draft.poses.position_xyz_m.shape == (draft.poses.n_frames, 22, 3)
        True

        See Also
        --------
        dance : makes the stage
        """
        from odori.drafts import draft_song

        return draft_song(
            self._drafts(),
            self._song(song).song_id,
            method=None if method is None else inputs.key("method", method),
            pins=inputs.texts("pins", pins),
            frame_rate_hz=_rate(frame_rate_hz),
            temperature=_temperature(temperature),
            seed=inputs.count("seed", seed, least=0),
        )

    def propose(self, song: str | CatalogueSong, at: str | float, *, pins: Sequence[str] = ()) -> list[PinProposal]:
        """List what could be pinned at a place of a song, with what each would cost; nothing is danced.

        Parameters
        ----------
        song : as :meth:`dance`
        at : a place as a pin names it: seconds, ``12.5-16``, ``bar:9-10``, ``start``, ``end``
        pins : to be kept beside

        Returns
        -------
        list of PinProposal
            The cheapest first; those out of reach, of infinite cost, last.

        Raises
        ------
        DanceRefusedError
            If the pins that are given cannot be kept.
        OdoriError
            If there is no such song or place.

        Examples
        --------
        >>> import odori
        >>> proposals = odori.demo().propose("drum_machine", 12)
        >>> kicks = [p for p in proposals if p.kind == "label" and p.name == "kick"]
        >>> kicks[0].pin
        '12=kick'

        See Also
        --------
        dance : takes ``pins=[proposal.pin]``
        """
        from odori.drafts import place_pins

        is_seconds = isinstance(at, int | float) and not isinstance(at, bool)
        place = f"{at:g}" if is_seconds else inputs.key("at", at)
        return place_pins(self._drafts(), self._song(song).song_id, place, pins=inputs.texts("pins", pins))

    def why(self, dance: str | MadeDance | PathLike[str], time_s: float) -> FrameOrigin:
        """Say where a moment of a dance comes from, and why it was chosen.

        Parameters
        ----------
        dance : MadeDance, a song, ``<song>|<method>``, or the path of a stage
        time_s : float, seconds of the song

        Returns
        -------
        FrameOrigin

        Raises
        ------
        OdoriError
            If there is no such dance, or the moment is not in it.

        Examples
        --------
        >>> import odori
        >>> studio = odori.demo()
        >>> origin = studio.why(studio.dance("drum_machine"), 12.0)
        >>> origin.clip_id in studio.clips
        True

        See Also
        --------
        MadeDance.why
        """
        return explain_frame(self.root, inputs.key("dance", dance), time_s)

    def search(
        self,
        clip: str | CatalogueClip | PathLike[str] = "",
        *,
        k: int = 10,
        label: Sequence[str] = (),
        style: Sequence[str] = (),
        licence: Sequence[str] = (),
        min_seconds: float = 0.0,
        max_seconds: float = float("inf"),
        like: Sequence[str] = (),
        unlike: Sequence[str] = (),
    ) -> list[SearchHit]:
        """Find the clips most like a motion.

        Parameters
        ----------
        clip : key, ``KEY@2.5-4`` for a stretch of it, or path of a BVH that need not be of the studio
        k : int, >= 1
        label, style, licence : only clips of any of these
        min_seconds, max_seconds : length of the clips found
        like, unlike : more motions to go towards, and away from

        Returns
        -------
        list of SearchHit
            The nearest first; the first search of a studio trains the encoder, which takes a minute.

        Raises
        ------
        OdoriError
            If there is no such motion, or a filter names what no clip has.

        Examples
        --------
        >>> import odori
        >>> hits = odori.demo().search("ayame-kick_01", k=3)
        >>> hits[0].label
        'kick'

        See Also
        --------
        clips
        """
        from pipelines.commands import search_motions as searching
        from pipelines.resources import NoProgress

        wish = searching.MotionQuery(
            inputs.key("clip", clip) if clip else "",
            inputs.count("k", k),
            label=inputs.texts("label", label),
            style=inputs.texts("style", style),
            licence=inputs.texts("licence", licence),
            min_seconds=inputs.number("min_seconds", min_seconds, least=0.0, most=float("inf")),
            max_seconds=inputs.number("max_seconds", max_seconds, least=0.0, most=float("inf")),
            like=inputs.texts("like", like),
            unlike=inputs.texts("unlike", unlike),
        )
        with refused(), threadpool_limits(limits=1):
            facts = searching.search(self.root, wish, progress=NoProgress).facts
        names = SearchHit.__dataclass_fields__
        return [SearchHit(**{name: hit[name] for name in names}) for hit in facts["hits"]]

    def _drafts(self) -> DraftRoom:
        """Give what drafts are made in: it remembers what it read."""
        from odori.drafts import DraftRoom

        if self._room is None:
            self._room = DraftRoom(self._folder)
        return self._room


def _rate(frame_rate_hz: float | None) -> float | None:
    return (
        None
        if frame_rate_hz is None
        else inputs.number("frame_rate_hz", frame_rate_hz, least=1.0, most=inputs.MOST_FRAMES_HZ)
    )


def _temperature(temperature: float | None) -> float | None:
    return None if temperature is None else inputs.number("temperature", temperature, least=0.0, most=inputs.WARMEST)
