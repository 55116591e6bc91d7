"""What is heard of real files: every conformance file read or refused, drums of every groove found."""

import pytest

from assets.formats import midi
from assets.formats.errors import FormatError
from kernels.music.drums_and_melody import FIRST_KEY, LAST_KEY, band_hits, contour, drum_hits
from kernels.music.preview import render_preview


def heard(path):
    """Hits of a file as the asset takes them; None where it is refused."""
    try:
        notes = midi.read(path, limit_s=1200.0).notes
    except FormatError:
        return None
    contour(notes)
    drums = drum_hits(notes).hits
    return drums if len(drums.time_s) else band_hits(render_preview(notes), 44100)


@pytest.mark.parametrize("folder", ["conformance_jazzsoft", "conformance_midifile"])
@pytest.mark.slow
def test_every_conformance_file_is_heard_or_refused(data_dir, folder):
    files = sorted((data_dir / "midi" / folder).glob("*.mid*"))
    assert files
    for path in files:
        hits = heard(path)
        if hits is not None and len(hits.time_s):
            assert FIRST_KEY <= hits.key_number.min() <= hits.key_number.max() <= LAST_KEY


def test_every_groove_has_drums_and_pads_beyond_general_midi_are_mapped(data_dir):
    mapped = {}
    for path in sorted((data_dir / "midi" / "groove").glob("*.mid")):
        drums = drum_hits(midi.read(path).notes)
        assert len(drums.hits.time_s)
        assert not drums.dropped
        mapped |= drums.mapped
    assert {22, 26, 58} & set(mapped)
