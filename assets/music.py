"""From the files under ``songs/`` to songs, beats, tempo candidates and loudness."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import dagster as dg
import numpy as np

from assets.declare import table_assets
from assets.formats import audio, beats_file, midi
from assets.formats.errors import FormatError
from assets.partitions import SONG, lake_key
from assets.plots import matching as matching_plots
from assets.plots.draw import markdown
from assets.plots.music import song_beats
from assets.sources.sources import SongFile, Studio, brief_version, song_version
from assets.stamps import Part, Parts, Progress, Stored, repeatable, version_of
from assets.tables import matching as matching_tables
from assets.tables import pack
from assets.tables.music import from_music_beat, from_music_loudness, from_music_tempo, to_music_beat
from kernels.assembly.timing import cover
from kernels.music.beats import BeatAnalysis, TempoCandidate, track_beats
from kernels.music.level import change_level, nudge
from kernels.music.loudness import loudness_db
from kernels.music.music_features import music_features
from kernels.music.preview import render_preview
from kernels.music.repeats import find_repeats
from kernels.music.segments import beat_features, cut_song, novelty
from kernels.types import BeatGrid, Float
from schemas import music as schema
from schemas.settings import BeatsBrief, Settings

_TABLES = (schema.SONG, schema.MUSIC_BEAT, schema.MUSIC_TEMPO, schema.MUSIC_LOUDNESS)


@table_assets(
    "music",
    _TABLES,
    group="music",
    code_version="1",
    settings="music_beat limits",
    sources="song",
    partitions=SONG,
    checks={"beats_found": (schema.MUSIC_BEAT, "Every song read has beats to dance to.")},
)
def music(
    context: dg.AssetExecutionContext, studio: dg.ResourceParam[Studio], progress: dg.ResourceParam[Progress]
) -> Iterator[dg.Output[Parts] | dg.AssetCheckResult]:
    """Read every song, or refuse it with a reason, and find its beats."""
    songs = studio.sources().songs_by_key()
    keys = [lake_key(key) for key in context.partition_keys]
    progress.begin("listening to songs", len(keys))
    made: list[dict[str, Part]] = []
    for key in keys:
        made.append(_parts(key, songs.get(key, ()), studio))
        progress.step()
    for table in _TABLES:
        yield dg.Output(Parts([parts[table.name] for parts in made]), table.name)
    silent = [parts[schema.SONG.name].key for parts in made if not parts[schema.MUSIC_BEAT.name].table.num_rows]
    yield dg.AssetCheckResult(
        check_name="beats_found",
        asset_key=schema.MUSIC_BEAT.name,
        passed=not silent,
        severity=dg.AssetCheckSeverity.WARN,
        metadata={"songs_without_beats": ", ".join(silent) or "none"},
    )


@dataclass(frozen=True, eq=False)
class SongAnalysis:
    """What a song is: its length and shape, its beats, its loudness."""

    duration_s: float
    sample_rate_hz: int
    n_channels: int
    analysis: BeatAnalysis
    time_s: Float
    loudness_db: Float


def listen(song: SongFile, studio: Studio, settings: Settings) -> SongAnalysis:
    """Read a song and find its beats, as its brief wants them.

    Parameters
    ----------
    song : SongFile
    studio : Studio
    settings : its settings

    Returns
    -------
    SongAnalysis

    Raises
    ------
    FormatError
        If the song, its brief or its beats file cannot be read.
    """
    place = studio.file(song.path)
    if song.kind == "midi":
        read = midi.read(place, limit_s=settings.limits.longest_song_s)
        sound, rate_hz, n_channels = render_preview(read.notes), PREVIEW_RATE_HZ, 0
        duration_s = len(sound) / rate_hz
        analysis = BeatAnalysis(read.beats, _level_of(read.beats))
    else:
        decoded = audio.read(place, limit_s=settings.limits.longest_song_s)
        sound, rate_hz, n_channels = decoded.samples, decoded.sample_rate_hz, decoded.samples.shape[1]
        duration_s = decoded.duration_s
        analysis = track_beats(sound, rate_hz, tracker=settings.music_beat.tracker)
    time_s, level_db = loudness_db(sound, rate_hz, frame_rate_hz=LOUDNESS_RATE_HZ)
    analysis = _within(_as_briefed(analysis, studio.brief(song).beats, studio, song), duration_s)
    return SongAnalysis(duration_s, 0 if song.kind == "midi" else rate_hz, n_channels, analysis, time_s, level_db)


PREVIEW_RATE_HZ = 44100
"""By convention that of compact discs."""

LOUDNESS_RATE_HZ = 20.0
"""Levels a second that are stored. Chosen by hand, to look at."""


def _as_briefed(analysis: BeatAnalysis, brief: BeatsBrief, studio: Studio, song: SongFile) -> BeatAnalysis:
    if brief.file:
        if "/" in brief.file or "\\" in brief.file:
            raise FormatError(
                song.brief, 0, f"beats.file: want the name of a file beside the brief, got {brief.file!r}; put it there"
            )
        grid = beats_file.read(studio.file(song.brief).parent / brief.file)
        analysis = BeatAnalysis(grid, _level_of(grid))
    grid = change_level(analysis.grid, brief.octave) if brief.octave != 1 else analysis.grid
    if brief.nudge_beats or brief.nudge_ms:
        grid = nudge(grid, beats=brief.nudge_beats, seconds=brief.nudge_ms / 1000)
    candidates = tuple(
        replace(c, level_ratio=c.level_ratio / brief.octave, is_chosen=bool(np.isclose(c.level_ratio, brief.octave)))
        for c in analysis.tempo_candidates
    )
    return BeatAnalysis(grid, candidates)


def _within(analysis: BeatAnalysis, duration_s: float) -> BeatAnalysis:
    """Keep the beats that are in the song: a file or a nudge may have put some outside."""
    grid = analysis.grid
    inside = (grid.time_s >= 0) & (grid.time_s <= duration_s + 1e-6)
    if inside.all():
        return analysis
    kept = (getattr(grid, name)[inside] for name in ("time_s", "bar_number", "beat_in_bar_number", "confidence"))
    return replace(analysis, grid=BeatGrid(*kept))


def _level_of(grid: BeatGrid) -> tuple[TempoCandidate, ...]:
    """Make the only candidate of beats that a file names."""
    if len(grid.time_s) < 2:
        return ()
    return (TempoCandidate(1.0, 60 / float(np.median(np.diff(grid.time_s))), 1.0, True),)


def _parts(key: str, songs: Sequence[SongFile], studio: Studio) -> dict[str, Part]:
    """Make the tables of one song; a refused one gets its row and no beats."""
    version = version_of(song_version(songs), brief_version(studio, songs))
    rows, danceable = [], None
    for song in songs:
        reason, heard = song.problem, None
        if not reason:
            try:
                with repeatable():
                    heard = listen(song, studio, studio.settings())
                reason = _undanceable(heard)
            except (FormatError, ValueError) as error:
                is_own = (
                    isinstance(error, FormatError) and error.path.rsplit("/", 1)[-1] == song.path.rsplit("/", 1)[-1]
                )
                reason = error.what if isinstance(error, FormatError) and is_own else str(error)
            except OSError as error:  # may be readable next time: never taken for fresh
                reason = f"cannot be read: {error.strerror or error}; see to the file"
                version = version_of(version, "unread")
        rows.append(_row(song, heard, reason))
        if heard is not None and not reason:
            danceable = heard
    refused = [f"{r['path']}: {r['reason']}" for r in rows if r["reason"]]
    parts = {table.name: Part(key, table.empty(), version) for table in _TABLES}
    parts |= _heard_parts(key, danceable, version) if danceable else {}
    parts[schema.SONG.name] = Part(
        key, pack.from_rows(schema.SONG, rows), version, metadata={"refusals": "; ".join(refused) or "none"}
    )
    return parts


def _heard_parts(key: str, heard: SongAnalysis, version: str) -> dict[str, Part]:
    grid, candidates = heard.analysis.grid, heard.analysis.tempo_candidates
    picture = song_beats(grid, heard.time_s, heard.loudness_db)
    levels = markdown(
        ("level", "beats/min", "score", "chosen"),
        [(c.level_ratio, c.tempo_bpm, c.score, "yes" if c.is_chosen else "") for c in candidates],
    )
    made = {
        schema.MUSIC_BEAT.name: (from_music_beat(key, grid), {"beats": dg.MetadataValue.md(picture)}),
        schema.MUSIC_TEMPO.name: (from_music_tempo(key, candidates), {"levels": dg.MetadataValue.md(levels)}),
        schema.MUSIC_LOUDNESS.name: (from_music_loudness(key, heard.time_s, heard.loudness_db), {}),
    }
    return {name: Part(key, table, version, metadata=metadata) for name, (table, metadata) in made.items()}


def _undanceable(heard: SongAnalysis) -> str:
    n = len(heard.analysis.grid.time_s)
    if n >= 2:
        return ""
    quiet = len(heard.loudness_db) == 0 or float(heard.loudness_db.max()) < SILENCE_DB
    why = "the song is silent" if quiet else f"{heard.duration_s:.1f} s gave {n}"
    return f"want at least two beats to dance to, {why}; name a beats file in its brief"


SILENCE_DB = -60.0
"""A song whose loudest level is lower is silent. Chosen by hand."""


def _row(song: SongFile, heard: SongAnalysis | None, reason: str) -> dict[str, object]:
    beats = heard.analysis.grid.time_s if heard and not reason else np.zeros(0)
    return {
        "song_id": song.key,
        "path": song.path.encode("utf-8", "backslashreplace").decode(),
        "source_sha256": song.sha256,
        "kind": song.kind,
        "duration_s": heard.duration_s if heard and not reason else 0.0,
        "sample_rate_hz": heard.sample_rate_hz if heard else 0,
        "channel_count": heard.n_channels if heard else 0,
        "tempo_bpm": 60 / float(np.median(np.diff(beats))) if len(beats) > 1 else 0.0,
        "state": "refused" if reason else "read",
        "reason": reason or None,
    }


@table_assets(
    "music_analysis",
    (schema.MUSIC_FEATURE, schema.MUSIC_SEGMENT, schema.MUSIC_REPEAT),
    group="music",
    code_version="2",
    settings="feature music_segment limits",
    sources="song",
    partitions=SONG,
)
def music_analysis(
    context: dg.AssetExecutionContext,
    music_beat: Stored,
    song: Stored,
    studio: dg.ResourceParam[Studio],
    progress: dg.ResourceParam[Progress],
) -> Iterator[dg.Output[Parts]]:
    """Measure rhythm and intensity of every song, cut it into segments, and find what it plays again."""
    songs = studio.sources().songs_by_key()
    keys = [lake_key(key) for key in context.partition_keys]
    progress.begin("measuring songs", len(keys))
    made: list[tuple[Part, Part, Part]] = []
    for key in keys:
        version = version_of(song_version(songs.get(key, ())), brief_version(studio, songs.get(key, ())))
        read = pack.read_rows(song.read(key)).to_pylist()
        grid = to_music_beat(music_beat.read(key))
        if read and len(grid.time_s) >= 2:
            with repeatable():
                made.append(_analysed(key, read[0], grid, studio, version))
        else:
            made.append(
                (
                    Part(key, schema.MUSIC_FEATURE.empty(), version),
                    Part(key, schema.MUSIC_SEGMENT.empty(), version),
                    Part(key, schema.MUSIC_REPEAT.empty(), version),
                )
            )
        progress.step()
    for number, table in enumerate((schema.MUSIC_FEATURE, schema.MUSIC_SEGMENT, schema.MUSIC_REPEAT)):
        yield dg.Output(Parts([parts[number] for parts in made]), table.name)


def _analysed(
    key: str, row: dict[str, object], grid: BeatGrid, studio: Studio, version: str
) -> tuple[Part, Part, Part]:
    """Features, segments and repeats of one song that can be danced to."""
    settings = studio.settings()
    place, duration_s = studio.file(str(row["path"])), float(row["duration_s"])  # type: ignore[arg-type]
    if row["kind"] == "midi":
        samples, rate_hz = render_preview(midi.read(place).notes), PREVIEW_RATE_HZ
    else:
        decoded = audio.read(place, limit_s=settings.limits.longest_song_s)
        samples, rate_hz = decoded.samples, decoded.sample_rate_hz
    found = music_features(
        samples, rate_hz, beat_s=grid.time_s, duration_s=duration_s, width_s=settings.feature.width_s
    )
    grid_s, is_beat = cover(grid.time_s, duration_s)
    number = np.zeros(len(grid_s), np.int64)
    number[is_beat] = grid.beat_in_bar_number
    heard = beat_features(samples, rate_hz, grid_s=grid_s)
    segments = cut_song(
        grid_s,
        duration_s=duration_s,
        beat_in_bar_number=number,
        change=novelty(heard),
        longest_s=settings.music_segment.longest_s,
    )
    picture = matching_plots.song_features(found.time_s, found.rhythm, found.intensity, segments)
    return (
        Part(key, matching_tables.from_music_feature(key, found), version),
        Part(
            key,
            matching_tables.from_music_segment(key, segments),
            version,
            metadata={"segments": dg.MetadataValue.md(picture)},
        ),
        Part(key, matching_tables.from_music_repeat(key, find_repeats(heard), grid_s), version),
    )
