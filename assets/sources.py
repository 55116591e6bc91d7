"""Which recordings and songs a studio has: their keys, hashes, labels, and what is wrong with them.

Policy only: what is a source, which session it belongs to, which of two files that want one key gets it. Reading a
recording's content is the business of the capture and music areas.
"""

import hashlib
import json
import time
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

from assets.formats import clips_csv, settings, suit, tree
from assets.formats.clips_csv import Facts
from assets.formats.errors import FormatError
from assets.formats.tree import File, HashCache
from assets.performances import Danced, Music, pair
from schemas.keys import clip_key, part_key, part_of, parts_in_use, session_key, song_key
from schemas.settings import Brief, Settings

MOTION_SUFFIXES = (".bvh", *suit.SUFFIXES)
# What `odori calibrate` leaves beside a recording is no recording.
POSES_ENDING = ".poses.parquet"
AUDIO_SUFFIXES = (".wav", ".flac", ".ogg", ".mp3")
MIDI_SUFFIXES = (".mid", ".midi")
# Said beside sources, not sources themselves.
DOCUMENT_SUFFIXES = (".txt", ".md", ".pdf", ".json", ".toml", ".csv", ".beats", ".html", ".rtf", ".copyright", "")
LARGEST_SESSION = 256
_MOTION = "a BVH file (.bvh) or a suit recording (.parquet, .csv)"


@dataclass(frozen=True)
class Clip:
    """A motion file of the studio.

    Parameters
    ----------
    key, session : its clip_id and the partition it lies in
    path : relative to the studio
    sha256 : of its bytes; empty where it was not read
    facts : label, style, subject, licence
    problem : why it is refused before it is opened; empty when it is not
    """

    key: str
    session: str
    path: str
    sha256: str
    facts: Facts
    problem: str = ""

    @property
    def kind(self) -> str:
        """Whether it is a ``"bvh"`` or the recording of a ``"suit"``."""
        return "suit" if self.path.lower().endswith(suit.SUFFIXES) else "bvh"


@dataclass(frozen=True)
class Song:
    """A music file of the studio; ``brief`` is its brief's path, empty when there is none."""

    key: str
    path: str
    sha256: str
    kind: str
    brief: str = ""
    problem: str = ""


@dataclass(frozen=True)
class Sources:
    """Everything found under one studio, and what was odd about the folder itself."""

    clips: tuple[Clip, ...]
    songs: tuple[Song, ...]
    notes: tuple[str, ...] = ()

    def sessions(self) -> dict[str, tuple[Clip, ...]]:
        """Clips by session, both in order."""
        found: dict[str, list[Clip]] = defaultdict(list)
        for clip in self.clips:
            found[clip.session].append(clip)
        return {session: tuple(found[session]) for session in sorted(found)}

    def song(self, key: str) -> Song:
        """Find the song of a key, the readable one where two files want the key; KeyError when there is none."""
        found = sorted((song for song in self.songs if song.key == key), key=lambda song: bool(song.problem))
        if not found:
            raise KeyError(key)
        return found[0]

    def songs_by_key(self) -> dict[str, tuple[Song, ...]]:
        """Songs by key: more than one where two files want it."""
        found: dict[str, list[Song]] = defaultdict(list)
        for song in self.songs:
            found[song.key].append(song)
        return {key: tuple(found[key]) for key in sorted(found)}

    @cached_property
    def performed_songs(self) -> frozenset[str]:
        """Keys of the songs that clips were danced to."""
        found, _ = pair(
            [
                Danced(c.key, c.path, c.facts.performed_to, c.facts.performed_offset_s)
                for c in self.clips
                if not c.problem
            ],
            [Music(s.key, s.path, s.kind) for s in self.songs if not s.problem],
        )
        return frozenset(one.song_id for one in found)


@dataclass(frozen=True)
class Request:
    """What a person asked of one dance beside the brief; remembered, so that a nightly rebuild makes the same.

    Parameters
    ----------
    frame_rate_hz : frames a second of the stage; 0 for the setting
    pins : as on the command line; beside those of the brief
    character : clip or USD file whose body is danced with; "" for the brief's
    temperature : of a dance by the model; None for the setting
    seed : of what is drawn at random
    """

    frame_rate_hz: float = 0.0
    pins: tuple[str, ...] = ()
    character: str = ""
    temperature: float | None = None
    seed: int = 0


class Studio(Protocol):
    """What assets ask of a studio folder."""

    def sources(self) -> Sources:
        """List what is there, hashed."""
        ...

    def settings(self) -> Settings:
        """Read ``odori.toml``."""
        ...

    def brief(self, song: Song) -> Brief:
        """Read a song's brief; every default where it has none."""
        ...

    def file(self, path: str) -> Path:
        """Place of a source on disk."""
        ...

    def requests(self) -> Mapping[str, Request]:
        """List what was asked of dances, by ``<song>|<method>``."""
        ...


def fingerprint(facts: object) -> str:
    """Hash of anything JSON can hold: 16 hexadecimal characters."""
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:16]


def session_version(clips: Iterable[Clip]) -> str:
    """Version of a session's sources: which files, with which bytes, labelled how."""
    return fingerprint([[c.path, c.sha256, asdict(c.facts), c.problem] for c in clips])


def song_version(songs: Iterable[Song]) -> str:
    """Version of a song's sources."""
    return fingerprint([[s.path, s.sha256, s.problem] for s in songs])


def scan(studio: Path, limits: Settings, *, sessions_in_use: Iterable[str] = (), cache: HashCache) -> Sources:
    """Find the sources of a studio.

    Parameters
    ----------
    studio : the folder with ``clips/`` and ``songs/``
    limits : settings; its size limits count
    sessions_in_use : keys of sessions stored so far, so that a split session keeps its parts
    cache : remembered hashes

    Returns
    -------
    Sources
        In order of path. Empty when both folders are missing or empty.
    """
    now_ns = time.time_ns()
    notes: list[str] = []
    clips = _clips(studio, limits, dict(parts_in_use(list(sessions_in_use))), cache, now_ns, notes)
    songs = _songs(studio, limits, cache, now_ns, notes)
    cache.save()
    return Sources(tuple(clips), tuple(songs), tuple(notes))


def _clips(
    studio: Path, limits: Settings, known_parts: Mapping[str, int], cache: HashCache, now_ns: int, notes: list[str]
) -> list[Clip]:
    root = studio / "clips"
    files = tree.walk(root, notes)
    said = _said(root, [f for f in files if clips_csv.is_clips_csv(f.name)], notes)
    sources = [f for f in files if _is_motion(root, f, notes)]
    by_folder: dict[tuple[str, ...], list[File]] = defaultdict(list)
    for file in sources:
        by_folder[file.folders].append(file)
    taken: dict[str, str] = {}
    clips = []
    for folders in sorted(by_folder):
        folder_key = session_key(folders)
        n_parts = _n_parts(len(by_folder[folders]), known_parts.get(folder_key, 1))
        for file in by_folder[folders]:
            key = clip_key(folders, file.stem)
            session = part_key(folder_key, part_of(file.name, n_parts), n_parts) if n_parts > 1 else folder_key
            path = f"clips/{file.path}"
            problem = _unreadable(file, MOTION_SUFFIXES, limits.limits.largest_clip_mb, _MOTION)
            digest, problem = ("", problem) if problem else _hashed(root, file, cache, now_ns)
            if not problem and taken.setdefault(key, path) != path:
                problem = f"want its own key, got {key!r}, which {taken[key]} has; rename one of the two files"
            clips.append(Clip(key, session, path, "" if problem else digest, _facts_of(said, file), problem))
    notes.extend(note for table in said if (note := table.note()))
    return clips


@dataclass(frozen=True)
class _Said:
    """What one ``clips.csv`` says, and which of its rows spoke of a file so far."""

    path: str
    folders: tuple[str, ...]
    facts: dict[str, Facts]
    used: set[str] = field(default_factory=set)

    def note(self) -> str:
        """Name the rows that speak of no file; empty when all do."""
        idle = sorted(self.facts.keys() - self.used)
        if not idle:
            return ""
        return (
            f"clips/{self.path}: {len(idle)} of {len(self.facts)} rows speak of no file here, such as {idle[0]!r}; "
            "a row names a file with its suffix, below the folder of the table"
        )


def _is_motion(root: Path, file: File, notes: list[str]) -> bool:
    """Whether a file is a source of motion, or stands there for one: tables of other kinds and documents are not."""
    if file.name.endswith(POSES_ENDING):
        return False
    if file.suffix != ".csv":
        return file.suffix not in DOCUMENT_SUFFIXES
    if clips_csv.is_clips_csv(file.name):
        return False
    if suit.is_recording(root / file.path):
        return True
    notes.append(f"clips/{file.path}: its first line has no columns of a suit recording; left alone")
    return False


def _n_parts(n_files: int, in_use: int) -> int:
    """Parts of a folder: as many as it has, unless it outgrew or far undergrew them."""
    if in_use > 1 and 32 * in_use <= n_files <= 200 * in_use:
        return in_use
    n_parts = 1
    while n_files > (LARGEST_SESSION if n_parts == 1 else 100 * n_parts):
        n_parts *= 2
    return n_parts


def _said(root: Path, files: Iterable[File], notes: list[str]) -> list[_Said]:
    """Read the ``clips.csv`` files, the nearest folder's first."""
    said = []
    for file in files:
        path = f"clips/{file.path}"
        try:
            data = (root / file.path).read_bytes()
            said.append(_Said(file.path, file.folders, clips_csv.parse(data, path)))
        except (FormatError, OSError) as error:
            notes.append(f"{error}; its labels are left out")
            continue
        for name, meant in clips_csv.misspelt_columns(data).items():
            notes.append(f"{path}: column {name!r} is not read; if {meant!r} was meant, name it so")
    return sorted(said, key=lambda table: -len(table.folders))


def _facts_of(said: Iterable[_Said], file: File) -> Facts:
    fallback = file.folders[-1] if file.folders else "clips"
    for table in said:
        if file.folders[: len(table.folders)] == table.folders:
            row = clips_csv.row_of(table.facts, file.folders, file.name)
            if row is not None:
                table.used.add(row)
                found = table.facts[row]
                return found if found.label else replace(found, label=fallback, is_labelled=False)
    return Facts(label=fallback, is_labelled=False)


def _hashed(root: Path, file: File, cache: HashCache, now_ns: int) -> tuple[str, str]:
    """Hash a file; or nothing, and why it cannot be read."""
    try:
        return cache.sha256(root, file, now_ns), ""
    except OSError as error:
        return "", f"cannot be read: {error.strerror or error}; see to the file and its permissions"


def _unreadable(file: File, suffixes: tuple[str, ...], largest_mb: float, wanted: str) -> str:
    if file.suffix not in suffixes:
        return f"want {wanted}, got {file.suffix!r}; export or unpack it as one"
    if file.size > largest_mb * 1e6:
        return f"want at most {largest_mb:g} MB, got {file.size / 1e6:.0f} MB; cut it, or raise the limit in odori.toml"
    return ""


def _songs(studio: Path, limits: Settings, cache: HashCache, now_ns: int, notes: list[str]) -> list[Song]:
    root = studio / "songs"
    files = tree.walk(root, notes)
    briefs = {f.path for f in files if f.name.endswith(".brief.toml")}
    sources = [f for f in files if f.suffix not in DOCUMENT_SUFFIXES]
    order = {suffix: i for i, suffix in enumerate(AUDIO_SUFFIXES + MIDI_SUFFIXES)}
    # One stem in several formats: audio keeps the plain key, the rest say their format: `a.wav` and `a.mid` both live.
    sources.sort(key=lambda f: (order.get(f.suffix, len(order)), f.path))
    taken: dict[str, File] = {}
    songs = []
    for file in sources:
        kind = "audio" if file.suffix in AUDIO_SUFFIXES else "midi" if file.suffix in MIDI_SUFFIXES else "unknown"
        problem = _unreadable(
            file,
            AUDIO_SUFFIXES + MIDI_SUFFIXES,
            limits.limits.largest_song_mb,
            f"audio ({', '.join(AUDIO_SUFFIXES)}) or MIDI (.mid)",
        )
        key = song_key(file.stem)
        if not problem:
            other = taken.get(key)
            if other is not None and other.suffix != file.suffix:
                key = song_key(f"{file.stem}_{file.suffix[1:]}")
            other = taken.setdefault(key, file)
            if other is not file:
                problem = f"want its own key, got {key!r}, which songs/{other.path} has; rename one of the two files"
        digest, problem = ("", problem) if problem else _hashed(root, file, cache, now_ns)
        brief = next((b for b in (f"{file.path}.brief.toml", _sibling(file, "brief.toml")) if b in briefs), "")
        songs.append(
            Song(
                key,
                f"songs/{file.path}",
                digest,
                kind,
                f"songs/{brief}" if brief else "",
                problem,
            )
        )
    return sorted(songs, key=lambda s: s.path)


def _sibling(file: File, ending: str) -> str:
    return "/".join([*file.folders, f"{file.stem}.{ending}"])


def read_brief(studio: Studio, song: Song) -> Brief:
    """Read the brief a song came with; every default where there is none."""
    return settings.read_brief(studio.file(song.brief)) if song.brief else Brief()


def brief_version(studio: Studio, songs: Iterable[Song]) -> str:
    """Version of what the briefs of a song say of its beats, the beats file they name included."""
    said = []
    for song in songs:
        if not song.brief:
            continue
        place = studio.file(song.brief)
        try:
            asked = settings.read_brief(place).beats
        except FormatError:
            said.append(tree.sha256(place))
            continue
        said.append(fingerprint(asdict(asked)))
        beats = asked.file
        beats_place = place.parent / beats
        if beats and beats_place.is_file():
            said.append(tree.sha256(beats_place))
    return fingerprint(said)


def request_of(studio: Studio, key: str) -> Request:
    """Find what was asked of a dance; nothing special where nobody asked."""
    return studio.requests().get(key, Request())


def request_version(studio: Studio, key: str, sources: Sources | None = None) -> str:
    """Version of what was asked of a dance: by the command, and by the brief of its song, of known sources or now's.

    Whose body it is danced with comes later: :func:`assets.characters.character_version`.
    """
    brief = brief_of(studio, key.split("|")[0], sources)
    directed = {"pin": [pin.text for pin in brief.pin], "pins": brief.pins, "allow": sorted(brief.allow)}
    asked = {**asdict(request_of(studio, key)), "character": ""}
    return fingerprint([asked, directed])


def brief_of(studio: Studio, song: str, sources: Sources | None = None) -> Brief:
    """Read the brief of a song by its key; every default where it has none, or one that cannot be read."""
    songs = [s for s in (sources or studio.sources()).songs_by_key().get(song, ()) if s.brief and not s.problem]
    try:
        return studio.brief(songs[0]) if songs else Brief()
    except FormatError:  # its song is refused for it
        return Brief()
