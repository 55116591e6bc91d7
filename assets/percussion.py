"""What a model of dancing hears of songs: drums by name, or onsets by band, and how the melody goes."""

from collections.abc import Iterator, Mapping

import dagster as dg
import numpy as np

from assets.declare import table_assets
from assets.formats import audio, midi
from assets.partitions import SONG, lake_key
from assets.plots import hmm as hmm_plots
from assets.sources.sources import Studio, brief_version, song_version
from assets.stamps import Part, Parts, Progress, Stored, repeatable, version_of
from assets.tables import hmm as hmm_tables
from assets.tables.pack import read_rows
from kernels.music.drums_and_melody import Contour, band_hits, contour, drum_hits
from kernels.music.preview import render_preview
from schemas.music import MELODY, PERCUSSION

PREVIEW_RATE_HZ = 44100
"""By convention that of compact discs."""


@table_assets(
    "percussion_and_melody",
    (PERCUSSION, MELODY),
    group="music",
    code_version="1",
    settings="limits",
    sources="song",
    partitions=SONG,
)
def percussion_and_melody(
    context: dg.AssetExecutionContext,
    song: Stored,
    studio: dg.ResourceParam[Studio],
    progress: dg.ResourceParam[Progress],
) -> Iterator[dg.Output[Parts]]:
    """Hear the drums and the melody of every song."""
    songs = studio.sources().songs_by_key()
    keys = [lake_key(key) for key in context.partition_keys]
    progress.begin("hearing drums", len(keys))
    made: list[tuple[Part, Part]] = []
    for key in keys:
        version = version_of(song_version(songs.get(key, ())), brief_version(studio, songs.get(key, ())))
        read = read_rows(song.read(key)).to_pylist()
        if read:
            with repeatable():
                made.append(_heard(key, read[0], studio, version))
        else:
            made.append((Part(key, PERCUSSION.empty(), version), Part(key, MELODY.empty(), version)))
        progress.step()
    yield dg.Output(Parts([drums for drums, _ in made]), PERCUSSION.name)
    yield dg.Output(Parts([tune for _, tune in made]), MELODY.name)


def _heard(key: str, row: dict[str, object], studio: Studio, version: str) -> tuple[Part, Part]:
    """Drums and melody of one song; a MIDI file without drums is played and heard as audio is."""
    place, limit_s = studio.file(str(row["path"])), studio.settings().limits.longest_song_s
    tune, counts = Contour(np.zeros(0), np.zeros(0, np.int64)), {}
    if row["kind"] == "midi":
        notes = midi.read(place, limit_s=limit_s).notes
        drums = drum_hits(notes)
        hits, tune, heard_as = drums.hits, contour(notes), "drums"
        counts = {"keys_mapped": _counted(drums.mapped), "keys_dropped": _counted(drums.dropped)}
        if not len(hits.time_s):
            hits, heard_as = band_hits(render_preview(notes), PREVIEW_RATE_HZ), "bands"
    else:
        decoded = audio.read(place, limit_s=limit_s)
        hits, heard_as = band_hits(decoded.samples, decoded.sample_rate_hz), "bands"
    picture = dg.MetadataValue.md(hmm_plots.drum_roll(hits))
    metadata = {"heard_as": heard_as, "drums": picture, **counts}
    return (
        Part(key, hmm_tables.from_percussion(key, hits, heard_as=heard_as), version, metadata=metadata),
        Part(key, hmm_tables.from_melody(key, tune), version),
    )


def _counted(keys: Mapping[int, int]) -> str:
    return ", ".join(f"{n} of key {key}" for key, n in keys.items()) or "none"
