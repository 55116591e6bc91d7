"""Find the sources of a studio: what is one, which session it belongs to, which of two files that want one key gets it.

Policy only: reading a recording's content is the business of the capture and music areas.
"""

import difflib
import time
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from assets.formats import clips_csv, suit, tree
from assets.formats.clips_csv import Facts
from assets.formats.errors import FormatError
from assets.formats.tree import File, HashCache
from assets.sources.sources import ClipFile, SongFile, Sources
from schemas.keys import clip_key, part_key, part_of, parts_in_use, session_key, song_key
from schemas.settings import Settings

MOTION_SUFFIXES = (".bvh", *suit.SUFFIXES)
# What `odori calibrate` leaves beside a recording is no recording.
POSES_ENDING = ".poses.parquet"
AUDIO_SUFFIXES = (".wav", ".flac", ".ogg", ".mp3")
MIDI_SUFFIXES = (".mid", ".midi")
# Said beside sources, not sources themselves.
DOCUMENT_SUFFIXES = (".txt", ".md", ".pdf", ".json", ".toml", ".csv", ".beats", ".html", ".rtf", ".copyright", "")
LARGEST_SESSION = 256
"""Clips of a folder from which it is parted (decision 0003). Chosen by hand."""

_MOTION = "a BVH file (.bvh) or a suit recording (.parquet, .csv)"


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
) -> list[ClipFile]:
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
            clips.append(ClipFile(key, session, path, "" if problem else digest, _facts_of(said, file), problem))
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


def _songs(studio: Path, limits: Settings, cache: HashCache, now_ns: int, notes: list[str]) -> list[SongFile]:
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
            SongFile(
                key,
                f"songs/{file.path}",
                digest,
                kind,
                f"songs/{brief}" if brief else "",
                problem,
            )
        )
    for idle in sorted({f"songs/{b}" for b in briefs} - {s.brief for s in songs}):
        wanted = idle.removesuffix(".brief.toml")
        near = difflib.get_close_matches(wanted, [s.path.rpartition(".")[0] for s in songs], n=1, cutoff=0.8)
        meant = f"; if {near[0]!r} was meant, name it {near[0]}.brief.toml" if near else ""
        notes.append(f"{idle}: no song {wanted} is beside it; left alone{meant}")
    return sorted(songs, key=lambda s: s.path)


def _sibling(file: File, ending: str) -> str:
    return "/".join([*file.folders, f"{file.stem}.{ending}"])
