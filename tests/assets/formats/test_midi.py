"""MIDI files: clocks, meters, notes, and files that are broken."""

import struct

import numpy as np
import pytest

from assets.formats import beats_file, midi
from assets.formats.errors import FormatError
from kernels.music.notes import sorted_notes

NOTE = [(0, b"\x90\x3c\x64"), (96, b"\x80\x3c\x00")]


def quantity(value):
    digits = [value & 0x7F]
    while value := value >> 7:
        digits.append(value & 0x7F | 0x80)
    return bytes(reversed(digits))


def track(events):
    body = b"".join(quantity(delta) + event for delta, event in events) + b"\x00\xff\x2f\x00"
    return b"MTrk" + struct.pack(">I", len(body)) + body


def song(*tracks, division=96, kind=1):
    return b"MThd" + struct.pack(">IHHH", 6, kind, len(tracks), division) + b"".join(track(t) for t in tracks)


def tempo(bpm):
    return b"\xff\x51\x03" + round(60e6 / bpm).to_bytes(3, "big")


def meter(beats, unit):
    return bytes([0xFF, 0x58, 4, beats, unit.bit_length() - 1, 24, 8])


def notes_for(quarters):
    return [(0, b"\x90\x3c\x64"), (96 * quarters, b"\x80\x3c\x00")]


def test_without_tempo_it_is_120_and_four_four():
    read = midi.parse(song(notes_for(6)))
    np.testing.assert_allclose(read.beats.time_s, np.arange(7) * 0.5)
    assert read.beats.beat_in_bar_number.tolist() == [1, 2, 3, 4, 1, 2, 3]
    assert read.beats.bar_number.tolist() == [1, 1, 1, 1, 2, 2, 2]
    assert read.notes.duration_s.tolist() == [3.0]
    assert read.tempo == ((0.0, 120.0),)


def test_of_two_tempi_on_one_tick_the_last_wins():
    """Forty on one tick, too: a sort that is not stable would mix them up."""
    assert midi.parse(song([(0, tempo(60)), (0, tempo(150)), *notes_for(4)])).beats.time_s[1] == pytest.approx(0.4)
    many = [(0, tempo(100 + i)) for i in range(40)]
    assert midi.parse(song([*many, *notes_for(4)])).beats.time_s[1] == pytest.approx(60 / 139, abs=1e-5)


def test_tempo_changes_between_beats():
    """Half a quarter at 60, then 120: the second beat comes after 0.5 + 0.25 s."""
    read = midi.parse(song([(0, tempo(60)), (48, tempo(120))], notes_for(4)))
    np.testing.assert_allclose(read.beats.time_s, [0, 0.75, 1.25, 1.75, 2.25])
    assert read.notes.duration_s[0] == pytest.approx(2.25)


@pytest.mark.parametrize(
    ("beats", "unit", "places"),
    [
        (3, 4, [1, 2, 3, 1, 2, 3, 1]),
        (6, 8, [1, 2, 3, 1, 2, 3, 1]),
        (2, 2, [1, 2, 3, 4, 1, 2, 3]),
    ],
)
def test_bars_follow_the_meter(beats, unit, places):
    read = midi.parse(song([(0, meter(beats, unit)), *notes_for(6)]))
    np.testing.assert_allclose(read.beats.time_s, np.arange(7) * 0.5)
    assert read.beats.beat_in_bar_number.tolist() == places


def test_seven_eight_is_two_two_three():
    read = midi.parse(song([(0, meter(7, 8)), *notes_for(7)]))
    np.testing.assert_allclose(read.beats.time_s, np.array([0, 1, 2, 3.5, 4.5, 5.5, 7]) / 2)
    assert read.beats.beat_in_bar_number.tolist() == [1, 2, 3, 1, 2, 3, 1]


def test_a_new_meter_starts_a_new_bar():
    read = midi.parse(song([(0, meter(4, 4)), (2 * 96, meter(3, 4))], notes_for(6)))
    assert read.beats.beat_in_bar_number.tolist() == [1, 2, 1, 2, 3, 1, 2]
    assert read.beats.bar_number.tolist() == [1, 1, 2, 2, 2, 3, 3]


def test_smpte_division_counts_seconds_whatever_the_tempo():
    """25 frames of 40 ticks: a tick is a millisecond; the tempo only spaces the beats."""
    read = midi.parse(song([(0, tempo(60)), (0, b"\x90\x3c\x64"), (2500, b"\x80\x3c\x00")], division=0xE728))
    assert read.notes.duration_s.tolist() == [2.5]
    np.testing.assert_allclose(read.beats.time_s, [0, 1, 2])
    drop = midi.parse(song([(0, b"\x90\x3c\x64"), (30000, b"\x80\x3c\x00")], division=0xE364))
    assert drop.notes.duration_s[0] == pytest.approx(10.01)


def test_tracks_of_type_two_follow_each_other():
    read = midi.parse(song([(0, tempo(60)), *notes_for(2)], notes_for(2), kind=2))
    assert read.notes.start_s.tolist() == [0.0, 2.0]
    assert read.notes.duration_s.tolist() == [2.0, 1.0]


def test_running_status_and_note_on_without_velocity():
    read = midi.parse(song([(0, b"\x90\x3c\x64"), (48, b"\x3c\x00"), (0, b"\x40\x50"), (48, b"\x40\x00")], kind=0))
    assert read.notes.key_number.tolist() == [60, 64]
    assert read.notes.start_s.tolist() == [0.0, 0.25]


def test_drums_and_programs_are_kept():
    read = midi.parse(song([(0, b"\xc1\x21"), (0, b"\x91\x24\x40"), (0, b"\x99\x26\x70"), (96, b"\x81\x24\x00")]))
    assert read.notes.channel_number.tolist() == [2, 10]
    assert read.notes.program_number.tolist() == [33, 0]
    assert read.notes.is_drum.tolist() == [False, True]
    assert read.notes.velocity.tolist() == [64, 112]


def test_note_without_end_lasts_to_the_end_of_its_track():
    read = midi.parse(song([(0, b"\x90\x3c\x64"), (192, tempo(120))]))
    assert read.notes.duration_s.tolist() == [1.0]


def test_nothing_sounds():
    read = midi.parse(song([(0, tempo(100))]))
    assert len(read.beats.time_s) == len(read.notes.start_s) == 0


def test_rmid_wrapper_and_strange_chunks():
    plain = song(notes_for(2))
    strange = plain[:14] + b"XFIH\x00\x00\x00\x03abc" + plain[14:] + b"trailing"
    wrapped = b"RIFF" + struct.pack("<I", len(plain) + 12) + b"RMIDdata" + struct.pack("<I", len(plain)) + plain
    for data in (strange, wrapped):
        np.testing.assert_array_equal(midi.parse(data).beats.time_s, midi.parse(plain).beats.time_s)


def test_cut_anywhere_it_is_refused():
    """No length of a broken copy crashes, hangs or passes for a shorter song."""
    whole = song([(0, tempo(100)), (0, meter(3, 4))], notes_for(4))
    first_track_ends = whole.index(b"MTrk", 20)
    for n in range(len(whole)):
        if first_track_ends <= n < first_track_ends + 8:  # a tail too short to be a track is trailing bytes
            assert len(midi.parse(whole[:n]).notes.start_s) == 0
            continue
        with pytest.raises(FormatError):
            midi.parse(whole[:n])


def test_noise_is_refused_or_read():
    """Bytes changed at random give a song or a FormatError, nothing else."""
    rng = np.random.default_rng(7)
    whole = song([(0, tempo(100)), (0, meter(3, 4)), *NOTE * 5], NOTE * 5)
    outcomes = set()
    for _ in range(400):
        data = bytearray(whole)
        for at in rng.integers(0, len(data), 3):
            data[at] = int(rng.integers(256))
        try:
            midi.parse(bytes(data))
            outcomes.add("read")
        except FormatError:
            outcomes.add("refused")
    assert outcomes == {"read", "refused"}


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "MThd"),
        (b"RIFF\x00\x00\x00\x00RMID", "MThd"),
        (song(notes_for(2), division=0), "tick a quarter"),
        (song(notes_for(2), division=0x8010), "SMPTE"),
        (song(notes_for(2), kind=3), "type 0, 1 or 2"),
        (song(), "at least one track"),
        (song([(0, b"\x3c\x64")]), "without a status"),
        (song([(0, b"\x90\x3c\xff")]), "data bytes"),
        (song([(0, b"\xf5")]), "0xf5"),
        (song([(0, b"\xff\x51\x03\x00\x00\x00")]), "tempo"),
        (song([(0, b"\xff\x58\x04\x00\x02\x18\x08")]), "time signature"),
        (song([(0x0FFFFFFF, b"\x90\x3c\x64"), (9, b"\x80\x3c\x00")]), "at most 3600 s"),
    ],
)
def test_refusals(data, said):
    with pytest.raises(FormatError, match=said) as caught:
        midi.parse(data, name="a.mid")
    assert caught.value.path == "a.mid"


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(FormatError, match="No such file"):
        midi.read(tmp_path / "none.mid")


def test_written_notes_come_back():
    notes = sorted_notes(
        [(0.0, 0.5, 60, 100, 1, 0), (0.25, 1.0, 36, 90, 10, 0), (1.5, 0.75, 64, 80, 3, 40), (1.5, 0.25, 67, 80, 3, 48)]
    )
    data = midi.format(notes, tempo=((0.0, 100.0), (1.2, 140.0)), meter=(3, 4))
    read = midi.parse(data)
    half_tick_s = 0.5 * 60 / 100 / 480
    for name in ("start_s", "duration_s"):
        np.testing.assert_allclose(getattr(read.notes, name), getattr(notes, name), atol=2 * half_tick_s)
    for name in ("key_number", "velocity", "channel_number", "program_number"):
        np.testing.assert_array_equal(getattr(read.notes, name), getattr(notes, name))
    assert read.beats.beat_in_bar_number.tolist()[:4] == [1, 2, 3, 1]
    assert read.tempo[1] == (pytest.approx(1.2), pytest.approx(140.0, abs=1e-3))
    assert midi.format(notes, tempo=((0.0, 100.0), (1.2, 140.0)), meter=(3, 4)) == data


def test_many_tempo_changes_do_not_drift():
    changes = tuple((0.37 * i, 90.0 + i) for i in range(100))
    notes = sorted_notes([(0.31 * i, 0.1, 60, 90, 1, 0) for i in range(120)])
    read = midi.parse(midi.format(notes, tempo=changes))
    np.testing.assert_allclose(read.notes.start_s, notes.start_s, atol=0.0008)


@pytest.mark.parametrize(
    "how", [{"tempo": ()}, {"tempo": ((1.0, 120.0),)}, {"tempo": ((0.0, 1.0),)}, {"meter": (0, 4)}, {"meter": (4, 3)}]
)
def test_writer_refuses(how):
    with pytest.raises(ValueError, match=r"tempo|meter"):
        midi.format(sorted_notes([]), **how)


def test_writing_nothing_reads_as_nothing():
    assert len(midi.parse(midi.format(sorted_notes([]))).notes.start_s) == 0


def test_real_files_are_read_or_refused(data_dir):
    """All songs read; of the files made to be broken only these are refused."""
    refused = set()
    for path in sorted((data_dir / "midi").glob("*/*.mid")):
        try:
            midi.read(path)
        except FormatError:
            refused.add(path.name)
    assert refused == {
        "test-empty-file.mid",
        "test-illegal-message-f5.mid",
        "MIDIBadHeaderChunk.mid",
        "MIDIBadHeaderLength.mid",
        "MIDIBadTrackLength.mid",
    }


def test_real_beats_are_the_true_ones(data_dir):
    for path in sorted((data_dir / "audio_beats").glob("midi_*.beats")):
        true, found = beats_file.read(path), midi.read(path.with_suffix(".mid")).beats
        n = len(true.time_s)
        np.testing.assert_allclose(found.time_s[:n], true.time_s, atol=1e-4)
        np.testing.assert_array_equal(found.beat_in_bar_number[:n], true.beat_in_bar_number)


def test_notes_agree_with_another_reader(data_dir):
    """Its tracks of type 2 sound at once, so those are left out."""
    symusic = pytest.importorskip("symusic")
    for path in sorted((data_dir / "midi").glob("[fgo]*/*.mid")):
        theirs = symusic.Score.from_file(str(path)).to("second")
        ours = midi.read(path).notes
        want = sorted((float(n.time), int(n.pitch), int(n.velocity)) for t in theirs.tracks for n in t.notes)
        got = sorted(zip(ours.start_s.tolist(), ours.key_number.tolist(), ours.velocity.tolist(), strict=True))
        assert len(got) == len(want)
        np.testing.assert_allclose([g[0] for g in got], [w[0] for w in want], atol=1e-3)


def test_a_file_cut_within_its_header_is_told_so():
    with pytest.raises(FormatError, match=r"want a header of 14 bytes, got 9 bytes in all: cut short"):
        midi.parse(b"MThd\0\0\0\x06\0")
