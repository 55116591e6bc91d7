"""Songs as notes: Standard MIDI Files, read to seconds, and a small writer.

Conventions
-----------
A *tick* is the file's unit of time. Channels are counted from 1, programs from 0. Beats are quarter notes, as MIDI
tempo counts them; in a bar that is not a whole number of quarters the last beat takes the rest (7/8 is 2 + 2 + 3).
"""

import math
import struct
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from assets.formats.errors import FormatError
from kernels.music.notes import Notes, sorted_notes
from kernels.types import BeatGrid

DEFAULT_TEMPO_US = 500_000
"""Microseconds a quarter note where a file has no tempo: 120 a minute, by definition of Standard MIDI Files."""

TICKS_A_QUARTER = 480
"""Of files that are written, by convention of sequencers."""

LARGEST_BYTES = 64 * 2**20
LONGEST_S = 3600.0
SMALLEST_TEMPO_US = 10_000
"""Bytes and seconds of a file, and microseconds a quarter: 6000 a minute. Chosen by hand, beyond any song."""

DATA_BYTES = {0x80: 2, 0x90: 2, 0xA0: 2, 0xB0: 2, 0xC0: 1, 0xD0: 1, 0xE0: 2}
SYSTEM_BYTES = {0xF1: 1, 0xF2: 2, 0xF3: 1, 0xF6: 0, 0xF8: 0, 0xF9: 0, 0xFA: 0, 0xFB: 0, 0xFC: 0, 0xFE: 0}
"""Data bytes that follow a message's first, by definition of MIDI."""


@dataclass(frozen=True, eq=False)
class Midi:
    """A MIDI file in seconds.

    Parameters
    ----------
    notes : Notes, percussion included
    beats : BeatGrid
        Quarter notes from the start to the end of the last note; empty without notes.
    tempo : (time_s, tempo_bpm) of each change, the first at 0 s
    """

    notes: Notes
    beats: BeatGrid
    tempo: tuple[tuple[float, float], ...]


@dataclass
class _Events:
    """What the tracks of a file say, in ticks and in the order of the file."""

    tempo: list[tuple[int, int]]
    meter: list[tuple[int, int, int]]
    note: list[tuple[int, int, int, int, int, int]]
    end: int = 0


class _Reader:
    """Bytes of one chunk, with a position; running past the end is a FormatError."""

    def __init__(self, data: bytes, start: int, end: int, name: str) -> None:
        self.data, self.at, self.end, self.name = data, start, end, name

    def fail(self, what: str) -> FormatError:
        return FormatError(self.name, 0, f"{what} at byte {self.at}; export the song again")

    def take(self, n: int) -> bytes:
        if self.at + n > self.end:
            raise self.fail(f"want {n} more bytes in the track, got {self.end - self.at}")
        self.at += n
        return self.data[self.at - n : self.at]

    def number(self) -> int:
        """Read a variable-length quantity of at most four bytes."""
        value = 0
        for _ in range(4):
            byte = self.take(1)[0]
            value = value << 7 | byte & 0x7F
            if byte < 0x80:
                return value
        raise self.fail("want a variable-length number of at most 4 bytes")


def read(path: Path, *, limit_s: float = LONGEST_S) -> Midi:
    """Read a MIDI file.

    Parameters
    ----------
    path : file of at most 64 MiB
    limit_s : float, seconds, > 0
        Longest song accepted.

    Returns
    -------
    Midi

    Raises
    ------
    FormatError
        If the file cannot be read or is not a MIDI file; see :func:`parse`.
    """
    try:
        size = path.stat().st_size
        if size > LARGEST_BYTES:
            raise FormatError(str(path), 0, f"want at most {LARGEST_BYTES >> 20} MiB of MIDI, got {size >> 20} MiB")
        data = path.read_bytes()
    except OSError as error:
        raise FormatError(str(path), 0, f"want a readable file, got: {error.strerror}") from error
    return parse(data, name=str(path), limit_s=limit_s)


def parse(data: bytes, *, name: str = "midi", limit_s: float = LONGEST_S) -> Midi:
    """Read the bytes of a MIDI file, types 0, 1 and 2, ticks a quarter or SMPTE division.

    Parameters
    ----------
    data : bytes
    name : str
        As the user knows the file, for messages.
    limit_s : float, seconds, > 0
        Longest song accepted.

    Returns
    -------
    Midi
        Without notes and beats when the file sounds nothing.

    Raises
    ------
    FormatError
        If the bytes are not MIDI, a track is cut short or broken, a tempo is faster than 6000 a minute, or the song is
        too long.

    Notes
    -----
    Of two tempo events on one tick the last in the file wins, and likewise for time signatures. Tracks of type 2 are
    played one after the other. With SMPTE division ticks are fractions of a second whatever the tempo events say;
    these then only set the distance of the beats. Chunks that are not tracks are skipped, and so is anything after
    the tracks; a note without an end lasts to the end of its track.
    """
    if data[:4] == b"RIFF" and data[8:12] == b"RMID":
        start = data.find(b"MThd")
        data = data[start:] if start >= 0 else b""
    if data[:4] == b"MThd" and len(data) < 14:
        raise FormatError(
            name, 0, f"want a header of 14 bytes, got {len(data)} bytes in all: cut short; export the song again"
        )
    if data[:4] != b"MThd":
        raise FormatError(name, 0, f"want a MIDI file that starts with MThd, got {data[:4]!r}; export the song again")
    header_length, kind, _, division = struct.unpack(">IHHH", data[4:14])
    if header_length < 6 or kind > 2:
        raise FormatError(name, 0, f"want a header of 6 bytes and type 0, 1 or 2, got {header_length} and {kind}")
    events = _read_tracks(data, 8 + header_length, kind, name)
    clock = _Clock(events.tempo, division, name)
    end_tick = max((note[1] for note in events.note), default=0)
    if not clock.second(end_tick) <= limit_s:
        raise FormatError(
            name, 0, f"want a song of at most {limit_s:g} s, got {clock.second(end_tick):.0f} s; cut it shorter"
        )
    notes = sorted_notes(
        [
            (clock.second(on), clock.second(off) - clock.second(on), key, velocity, channel, program)
            for on, off, key, velocity, channel, program in events.note
        ]
    )
    beats = _beats(clock, events.meter, end_tick) if events.note else _grid([], [], [])
    tempo = tuple((time_s, 60.0 / seconds) for time_s, seconds in zip(clock.at_s, clock.quarter_s, strict=True))
    return Midi(notes=notes, beats=beats, tempo=tempo)


def format(
    notes: Notes, *, tempo: Sequence[tuple[float, float]] = ((0.0, 120.0),), meter: tuple[int, int] = (4, 4)
) -> bytes:
    """Write notes as a MIDI file of type 1, 480 ticks a quarter: a tempo track, then one track a channel.

    Parameters
    ----------
    notes : Notes
    tempo : (time_s, tempo_bpm) of each change
        The first at 0 s, times increasing, 4 to 6000 beats a minute.
    meter : (int, int)
        Beats of a bar, 1 to 255, and the note that is one beat: 1, 2, 4, 8, 16, 32 or 64.

    Returns
    -------
    bytes
        The same for the same notes. Times are rounded to a tick, notes last at least one.

    Raises
    ------
    ValueError
        If the tempo or the meter does not fit.
    """
    if not tempo or tempo[0][0] != 0 or any(b[0] <= a[0] for a, b in pairwise(tempo)):
        raise ValueError(f"tempo: want a first change at 0 s and increasing times, got {tempo}")
    if not all(4.0 <= bpm <= 6000.0 for _, bpm in tempo):
        raise ValueError(f"tempo: want 4 to 6000 beats a minute, got {tempo}")
    beats, unit = meter
    if not 1 <= beats <= 255 or unit not in (1, 2, 4, 8, 16, 32, 64):
        raise ValueError(f"meter: want 1 to 255 over a power of two up to 64, got {meter}")
    changes = [(0, 0.0, round(60e6 / tempo[0][1]))]
    for time_s, bpm in tempo[1:]:
        tick, since_s, tempo_us = changes[-1]
        step = round((time_s - since_s) * 1e6 / tempo_us * TICKS_A_QUARTER)
        changes.append((tick + step, since_s + step * tempo_us * 1e-6 / TICKS_A_QUARTER, round(60e6 / bpm)))

    def to_tick(time_s: float) -> int:
        tick, since_s, tempo_us = changes[max(bisect_right(changes, time_s, key=lambda change: change[1]) - 1, 0)]
        return tick + round((time_s - since_s) * 1e6 / tempo_us * TICKS_A_QUARTER)

    head = [(0, bytes([0xFF, 0x58, 4, beats, unit.bit_length() - 1, 24, 8]))]
    head += [(tick, b"\xff\x51\x03" + tempo_us.to_bytes(3, "big")) for tick, _, tempo_us in changes]
    tracks = [_format_track(head)]
    for channel in sorted(set(notes.channel_number.tolist())):
        rows: list[tuple[int, int, bytes]] = []
        sound = -1
        for i in np.flatnonzero(notes.channel_number == channel):
            on = to_tick(float(notes.start_s[i]))
            off = max(to_tick(float(notes.start_s[i] + notes.duration_s[i])), on + 1)
            key, velocity, program = int(notes.key_number[i]), int(notes.velocity[i]), int(notes.program_number[i])
            if program != sound:
                rows.append((on, 1, bytes([0xBF + channel, program])))
                sound = program
            rows.append((on, 1, bytes([0x8F + channel, key, velocity])))
            rows.append((off, 0, bytes([0x7F + channel, key, 64])))
        rows.sort(key=lambda row: row[:2])  # stable: a program stays before its note, ends come before starts
        tracks.append(_format_track([(tick, event) for tick, _, event in rows]))
    return b"MThd" + struct.pack(">IHHH", 6, 1, len(tracks), TICKS_A_QUARTER) + b"".join(tracks)


def _format_track(events: list[tuple[int, bytes]]) -> bytes:
    """Write events, sorted by tick, as a chunk."""
    body = bytearray()
    now = 0
    for tick, event in [*events, (events[-1][0] if events else 0, b"\xff\x2f\x00")]:
        delta = tick - now
        now = tick
        digits = [delta & 0x7F]
        while delta := delta >> 7:
            digits.append(delta & 0x7F | 0x80)
        body += bytes(reversed(digits)) + event
    return b"MTrk" + struct.pack(">I", len(body)) + bytes(body)


def _read_tracks(data: bytes, at: int, kind: int, name: str) -> _Events:
    """Walk the chunks; tracks of type 2 follow each other in time."""
    events = _Events([], [], [])
    n_tracks = 0
    while at + 8 <= len(data):
        chunk, length = data[at : at + 4], struct.unpack(">I", data[at + 4 : at + 8])[0]
        if at + 8 + length > len(data):
            if chunk != b"MTrk":
                break
            raise FormatError(
                name, 0, f"want a track of {length} bytes, got {len(data) - at - 8}: cut short; export the song again"
            )
        if chunk == b"MTrk":
            n_tracks += 1
            offset = events.end if kind == 2 else 0
            if kind == 2 and n_tracks > 1:
                events.tempo.append((offset, DEFAULT_TEMPO_US))
                events.meter.append((offset, 4, 4))
            _read_track(_Reader(data, at + 8, at + 8 + length, name), offset, events)
        at += 8 + length
    if not n_tracks:
        raise FormatError(name, 0, "want at least one track, got none; export the song again")
    return events


def _read_track(reader: _Reader, tick: int, events: _Events) -> None:
    """Add the events of one track that starts at a tick."""
    status = 0
    program = [0] * 16
    sounding: dict[tuple[int, int], list[tuple[int, int, int]]] = {}
    while reader.at < reader.end:
        tick += reader.number()
        byte = reader.take(1)[0]
        if byte == 0xFF:
            meta, body = reader.take(1)[0], reader.take(reader.number())
            if meta == 0x2F:
                break
            if meta == 0x51 and len(body) >= 3:
                tempo_us = int.from_bytes(body[:3], "big")
                if tempo_us < SMALLEST_TEMPO_US:
                    raise reader.fail(f"want a tempo of at least {SMALLEST_TEMPO_US} us a quarter, got {tempo_us},")
                events.tempo.append((tick, tempo_us))
            elif meta == 0x58 and len(body) >= 2:
                if body[0] == 0 or body[1] > 6:
                    raise reader.fail(f"want a time signature, got {body[0]} over 2^{body[1]},")
                events.meter.append((tick, body[0], 1 << body[1]))
            continue
        if byte in (0xF0, 0xF7):
            reader.take(reader.number())
            continue
        if byte >= 0xF0:
            if byte not in SYSTEM_BYTES:
                raise reader.fail(f"want a known event, got status byte {byte:#x},")
            reader.take(SYSTEM_BYTES[byte])
            continue
        if byte >= 0x80:
            status = byte
            first = reader.take(1)[0]
        elif status:
            first = byte
        else:
            raise reader.fail(f"want an event, got data byte {byte:#x} without a status,")
        action, channel = status & 0xF0, status & 0x0F
        second = reader.take(1)[0] if DATA_BYTES[action] == 2 else 0
        if first > 127 or second > 127:
            raise reader.fail(f"want data bytes below 0x80, got {first:#x} {second:#x},")
        if action == 0xC0:
            program[channel] = first
        elif action == 0x90 and second:
            sounding.setdefault((channel, first), []).append((tick, second, program[channel]))
        elif action in (0x80, 0x90) and sounding.get((channel, first)):
            on, velocity, sound = sounding[channel, first].pop(0)
            events.note.append((on, tick, first, velocity, channel + 1, sound))
    for (channel, key), left in sounding.items():
        events.note += [(on, tick, key, velocity, channel + 1, sound) for on, velocity, sound in left]
    events.end = max(events.end, tick)


class _Clock:
    """Ticks to seconds and to the tempo that holds there."""

    def __init__(self, tempo: list[tuple[int, int]], division: int, name: str) -> None:
        last = {0: DEFAULT_TEMPO_US}
        for tick, tempo_us in sorted(tempo, key=lambda event: event[0]):  # stable: the last of a tick wins
            last[tick] = tempo_us
        self.ticks = sorted(last)
        self.quarter_s = [last[tick] * 1e-6 for tick in self.ticks]
        if division & 0x8000:
            frames, ticks_a_frame = 256 - (division >> 8), division & 0xFF
            rate = 30000 / 1001 if frames == 29 else float(frames)
            if frames not in (24, 25, 29, 30) or not ticks_a_frame:
                raise FormatError(name, 0, f"want SMPTE 24, 25, 29 or 30 with ticks, got {frames} with {ticks_a_frame}")
            self.tick_s = [1.0 / (rate * ticks_a_frame)] * len(self.ticks)
        elif division:
            self.tick_s = [quarter_s / division for quarter_s in self.quarter_s]
        else:
            raise FormatError(name, 0, "want at least one tick a quarter, got 0; export the song again")
        self.at_s, self.at_quarter = [0.0], [0.0]
        for i in range(1, len(self.ticks)):
            span_s = (self.ticks[i] - self.ticks[i - 1]) * self.tick_s[i - 1]
            self.at_s.append(self.at_s[-1] + span_s)
            self.at_quarter.append(self.at_quarter[-1] + span_s / self.quarter_s[i - 1])

    def second(self, tick: float) -> float:
        i = bisect_right(self.ticks, tick) - 1
        return self.at_s[i] + (tick - self.ticks[i]) * self.tick_s[i]

    def quarter(self, tick: float) -> float:
        """Quarter notes from the start to a tick."""
        i = bisect_right(self.ticks, tick) - 1
        return self.at_quarter[i] + (tick - self.ticks[i]) * self.tick_s[i] / self.quarter_s[i]

    def second_of_quarter(self, quarter: float) -> float:
        """Invert :meth:`quarter`, in seconds."""
        i = bisect_right(self.at_quarter, quarter + 1e-9) - 1
        return self.at_s[i] + (quarter - self.at_quarter[i]) * self.quarter_s[i]


def _beats(clock: _Clock, meter: list[tuple[int, int, int]], end_tick: int) -> BeatGrid:
    """Lay quarter notes through the tempo map, counted in the bars of the time signatures."""
    last = {0: (4, 4)}
    for tick, beats, unit in sorted(meter, key=lambda event: event[0]):
        last[tick] = (beats, unit)
    starts = sorted(last)
    end_s = clock.second(end_tick)
    quarter, bar, number = [], [], []
    bar_number = 0
    for i, tick in enumerate(starts):
        at, stop = clock.quarter(tick), clock.quarter(starts[i + 1]) if i + 1 < len(starts) else math.inf
        stop = min(stop, clock.quarter(end_tick) + 1.0)
        bar_length = last[tick][0] * 4.0 / last[tick][1]
        n_beats = max(int(bar_length + 1e-9), 1)
        while at < stop - 1e-6:
            bar_number += 1
            for beat in range(n_beats):
                if at + beat < stop - 1e-6:
                    quarter.append(at + beat)
                    bar.append(bar_number)
                    number.append(beat + 1)
            at += bar_length
    time_s = [clock.second_of_quarter(q) for q in quarter]
    kept = [i for i, second in enumerate(time_s) if second <= end_s + 1e-6]
    return _grid([time_s[i] for i in kept], [bar[i] for i in kept], [number[i] for i in kept])


def _grid(time_s: list[float], bar: list[int], number: list[int]) -> BeatGrid:
    return BeatGrid(
        time_s=np.array(time_s, np.float64),
        bar_number=np.array(bar, np.int64),
        beat_in_bar_number=np.array(number, np.int64),
        confidence=np.ones(len(time_s)),
    )
