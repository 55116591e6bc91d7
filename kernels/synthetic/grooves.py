"""Drum patterns of popular styles, written by hand as step strings: what a band plays in one bar.

Conventions
-----------
One character a step: ``.`` rest, ``o`` soft, ``x`` plain,
        ``X`` accented. A bar has ``beats_per_bar * steps_per_beat``
steps; shorter strings repeat. Three steps a beat are triplets: swing, shuffle and compound time.
"""

from __future__ import annotations

from dataclasses import dataclass

KICK, SNARE, STICK, CLAP, HAT, PEDAL, OPEN_HAT, RIDE, CRASH = 36, 38, 37, 39, 42, 44, 46, 51, 49
LOW_TOM, MIDDLE_TOM, HIGH_TOM, TAMBOURINE, COWBELL, SHAKER, HIGH_CONGA, LOW_CONGA, CLAVES = (
    43,
    45,
    48,
    54,
    56,
    70,
    62,
    64,
    75,
)
"""Keys of General MIDI percussion [MMA1991]."""


@dataclass(frozen=True)
class Groove:
    """A style: its tempo, its bar and what each instrument may play.

    Parameters
    ----------
    name : str
    slowest_bpm, fastest_bpm : float, beats a minute
    beats_per_bar : int, >= 1
    steps_per_beat : 3 or 4
    kick, snare, time : patterns to choose from; ``time`` is the hi-hat, ride or shaker that runs through
    snare_keys, time_keys : percussion keys to choose from
    extra : pairs of percussion key and pattern, added by chance
    bass, chords : names of ways to accompany, understood by :mod:`kernels.synthetic.arrangement`
    weight : float, > 0
        How often the style is chosen.
    """

    name: str
    slowest_bpm: float
    fastest_bpm: float
    beats_per_bar: int
    steps_per_beat: int
    kick: tuple[str, ...]
    snare: tuple[str, ...]
    time: tuple[str, ...]
    snare_keys: tuple[int, ...] = (SNARE,)
    time_keys: tuple[int, ...] = (HAT, HAT, RIDE)
    extra: tuple[tuple[int, str], ...] = ()
    bass: tuple[str, ...] = ("kick", "eighths", "roots")
    chords: tuple[str, ...] = ("held", "quarters", "eighths", "syncopated", "strum", "tresillo")
    weight: float = 1.0


BACKBEAT = "....X.......X..."
EIGHTHS, SIXTEENTHS, QUARTERS = "x.x.", "xoxo", "x..."

GROOVES = (
    Groove(
        "rock", 85, 165, 4, 4,
        ("x.......x.......", "x.......x.x.....", "x..x....x.......", "x.....x.x.......", "x.......x..x....",
         "x.x.....x.x.....", "x..x..x.x..x....", "x.....x...x.....", "x......xx......."),
        (BACKBEAT, BACKBEAT, "....X.......X..o", "....X..o.o..X..."),
        (EIGHTHS, EIGHTHS, "X.x.", QUARTERS, "X...x..."),
        time_keys=(HAT, HAT, RIDE, OPEN_HAT, CRASH), weight=5.0,
    ),
    Groove(
        "fast rock and punk", 150, 212, 4, 4,
        ("x.......x.......", "x.......x.x.....", "x.x.....x.x.....", "x.....x.x.......", "x...x...x...x..."),
        (BACKBEAT, BACKBEAT, "....X.......X.x."),
        (EIGHTHS, QUARTERS, "X.x."),
        time_keys=(HAT, OPEN_HAT, RIDE, CRASH), bass=("eighths", "kick"), chords=("eighths", "held", "quarters"),
        weight=3.0,
    ),
    Groove(
        "double time", 88, 138, 4, 4,
        ("x...x...x...x...", "x..xx..xx..xx..x", "x...x..xx...x..x", "x.x.x.x.x.x.x.x.", "xx..x..x.x..xx.x"),
        ("..X...X...X...X.", "..X...X...X...Xo"), (EIGHTHS, SIXTEENTHS, "x...x.x."),
        time_keys=(HAT, RIDE, OPEN_HAT, CRASH),
        bass=("kick", "eighths", "octaves"), chords=("eighths", "held", "offbeat", "sixteenths"), weight=2.0,
    ),
    Groove(
        "metal", 100, 200, 4, 4,
        ("x.x.x.x.x.x.x.x.", "xxxxxxxxxxxxxxxx", "x..xx..xx..xx..x", "x.xxx.xxx.xxx.xx", "x.......x.......",
        "xxx.xxx.xxx.xxx."),
        (BACKBEAT, BACKBEAT, "........X.......", "..x...x...x...x."),
        (QUARTERS, EIGHTHS, "X...x..."),
        time_keys=(RIDE, CRASH, OPEN_HAT), bass=("kick", "eighths"), chords=("kick", "eighths", "gallop",
        "sixteenths"),
        weight=3.0,
    ),
    Groove(
        "four on the floor", 108, 138, 4, 4,
        ("X...X...X...X...",), (BACKBEAT, BACKBEAT, "................", "....X..x....X..x"),
        ("..x...x...x...x.", "..x...x...x...x.", EIGHTHS, SIXTEENTHS, "o.X.o.X."),
        snare_keys=(SNARE, CLAP, CLAP), time_keys=(HAT, OPEN_HAT),
        extra=((CLAP, "....x.......x..."), (SHAKER, SIXTEENTHS), (COWBELL, "x..x..x..x..x.x.")),
        bass=("offbeat", "octaves", "eighths", "kick", "syncopated"),
        chords=("held", "offbeat", "syncopated", "arpeggio16"), weight=3.0,
    ),
    Groove(
        "funk", 88, 124, 4, 4,
        ("x..x..x....x..x.", "x.x....x..x.....", "x.....x...x..x..", "x..x......x..x..", "xx....x...x....."),
        ("....X..o.o..X..o", "....X..o..o.X...", BACKBEAT, "....X..x.x..X..x"),
        (SIXTEENTHS, "xoXo", EIGHTHS),
        bass=("kick", "syncopated16"), chords=("syncopated16", "offbeat", "held"), weight=2.0,
    ),
    Groove(
        "hip hop", 74, 104, 4, 4,
        ("x.....xx..x.....", "x..x......x..x..", "x.........x.....", "x......x..x.....", "x..x..x...x....."),
        (BACKBEAT, BACKBEAT, "....X..o....X.o."), (EIGHTHS, SIXTEENTHS, "x.xx"),
        snare_keys=(SNARE, CLAP, STICK), time_keys=(HAT, SHAKER), bass=("kick", "roots"),
        chords=("held", "arpeggio8", "syncopated"), weight=2.0,
    ),
    Groove(
        "drum and bass", 160, 178, 4, 4,
        ("x.........x.....", "x.x.......x.....", "x..x......x....."), (BACKBEAT, "....X..o.o..X..o"),
        (EIGHTHS, SIXTEENTHS), bass=("roots", "syncopated"), chords=("held", "syncopated"),
    ),
    Groove(
        "half time", 120, 172, 4, 4,
        ("x.............x.", "x.......x.......", "x.....x.......x.", "x..x............"), ("........X.......",),
        (QUARTERS, EIGHTHS), weight=0.7,
    ),
    Groove(
        "ballad", 58, 92, 4, 4,
        ("x.......x.......", "x.........x.....", "x......xx.......", "x.....x.x......."), (BACKBEAT,),
        (EIGHTHS, SIXTEENTHS, QUARTERS), snare_keys=(SNARE, STICK), bass=("roots", "kick"),
        chords=("held", "arpeggio8", "arpeggio16", "quarters", "strum"), weight=2.5,
    ),
    Groove(
        "reggae", 66, 92, 4, 4,
        ("........X.......", "X.......X.......", "X...X...X...X..."), ("........X.......", BACKBEAT),
        ("x.x.", "x.xx", "..x."), snare_keys=(STICK, SNARE), bass=("syncopated", "kick"), chords=("offbeat",
        "offbeat"),
    ),
    Groove(
        "reggaeton", 86, 108, 4, 4,
        ("X...X...X...X...",), ("...X..X....X..X.",), (EIGHTHS, SIXTEENTHS), bass=("kick", "syncopated"),
        chords=("held", "offbeat", "syncopated"),
    ),
    Groove(
        "three three two", 92, 156, 4, 4,
        ("x..x..x.x..x..x.", "X...X...X...X...", "x..x..x.........", "x.........x....."),
        ("x..x..x.x..x..x.", "....X.......X...", "........X.......", "......x.......x."),
        ("x..x..x.", EIGHTHS, QUARTERS, SIXTEENTHS), bass=("syncopated", "kick", "eighths"),
        chords=("tresillo", "syncopated", "tresillo", "held"), weight=1.5,
    ),
    Groove(
        "samba and baiao", 88, 130, 4, 4,
        ("x..xx..xx..xx..x", "x..x....x..x....", "o...X...o...X...", "x.....x.x.....x."),
        ("x.x..x.x.xx..x.x", "..x..x..x.x..x..", "....x.......x..."), (SIXTEENTHS, "XooX"),
        snare_keys=(SNARE, STICK, CLAVES), time_keys=(SHAKER, TAMBOURINE, HAT),
        extra=((HIGH_CONGA, "..xx..x...xx..x."), (COWBELL, "x.x..x.x.xx..x.x")), bass=("kick", "roots"),
        chords=("syncopated16", "syncopated"), weight=1.5,
    ),
    Groove(
        "bossa and rumba", 100, 150, 4, 4,
        ("x.....x.x.....x.",), ("x..x..x...x..x..", "x..x...x..x.x...", "..x.x...x..x..x."), (EIGHTHS,),
        snare_keys=(STICK, CLAVES), time_keys=(SHAKER, HAT, RIDE),
        extra=((LOW_CONGA, "......xx......xx"), (HIGH_CONGA, "..x...x...x...x.")), bass=("kick",),
        chords=("syncopated", "held"),
    ),
    Groove(
        "soul stomp", 108, 190, 4, 4,
        ("x..x..x.x..x..x.", "x...x...x...x...", "x.....x.x.x....."), ("X...X...X...X...",), (EIGHTHS, QUARTERS),
        extra=((TAMBOURINE, "....X.......X..."), (TAMBOURINE, EIGHTHS)), bass=("eighths", "kick", "walking"),
        chords=("quarters", "offbeat", "held"),
    ),
    Groove(
        "march and polka", 92, 150, 4, 4,
        ("X.......X.......",), ("....x.......x...", "..x...x...x...x.", "x.xxx.x.x.xxx.x."), ("....", QUARTERS),
        snare_keys=(SNARE, STICK), extra=((CRASH, "X..............."),), bass=("roots", "twobeat"),
        chords=("offbeat", "backbeat"),
    ),
    Groove(
        "swing", 108, 226, 4, 3,
        ("o..o..o..o..", "x...........", "............", "o.....o....."), ("............", "..o.....o...",
        ".....o.....o"),
        ("X..x.xX..x.x", "x..x.xx..x.x"), time_keys=(RIDE, RIDE, HAT), extra=((PEDAL, "...x.....x.."),),
        bass=("walking",), chords=("syncopated", "held", "backbeat"), weight=2.0,
    ),
    Groove(
        "shuffle", 84, 150, 4, 3,
        ("x.....x.....", "x....xx.....", "x..x..x..x.."), ("...X.....X..",), ("x.x", "X.x", "x.."),
        bass=("walking", "shuffle", "roots"), chords=("shuffle", "held", "backbeat"), weight=2.0,
    ),
    Groove(
        "slow triplets", 48, 76, 4, 3,
        ("x.....x.....", "x....xx....."), ("...X.....X..",), ("xoo", "xxx"), bass=("roots", "kick"),
        chords=("triplets", "held"), weight=0.7,
    ),
    Groove(
        "waltz", 84, 204, 3, 4,
        ("X...........", "x.......x...", "x.....x....."), ("....x...x...", "........x...", "....x......."),
        (QUARTERS, EIGHTHS, "...."), snare_keys=(SNARE, STICK, HAT), bass=("roots",),
        chords=("backbeat", "held", "arpeggio8", "quarters"), weight=3.0,
    ),
    Groove(
        "rock in three", 90, 180, 3, 4,
        ("x...........", "x.....x.....", "x.x.....x..."), ("........X...", "....X.......", "....X...X..."),
        (EIGHTHS, SIXTEENTHS),
        weight=1.5,
    ),
    Groove(
        "jazz waltz", 110, 205, 3, 3, ("x........", "x....o..."), (".....o...", "........."), ("x..x.xx..",
        "x..x.xx.x"),
        time_keys=(RIDE,), extra=((PEDAL, "...x....."),), bass=("roots", "walking"), chords=("held", "syncopated"),
        weight=0.8,
    ),
    Groove(
        "six eight", 44, 84, 2, 3, ("x.....", "x....x", "x.x..."), ("...X..",), ("xxx", "Xxx", "x.x"),
        bass=("roots", "kick"), chords=("triplets", "held", "arpeggio8"), weight=1.5,
    ),
    Groove(
        "metronome", 46, 214, 4, 4, ("x...", "X...", "X...x...x...x..."), ("....",), ("....", "....", "..x."),
        time_keys=(HAT, CLAVES, COWBELL), bass=("walking", "roots"), chords=("quarters", "held"), weight=1.5,
    ),
    Groove(
        "five", 88, 170, 5, 4,
        ("x.....x.....x.......", "x...........x......."), ("....X...........X...", "........X.......X..."),
        (EIGHTHS, QUARTERS),
        weight=0.7,
    ),
    Groove(
        "seven", 100, 190, 7, 4, ("x.......x.......x...........",), ("....X.......X.......X...X...",), (EIGHTHS,
        QUARTERS),
        weight=0.4,
    ),
)  # fmt: skip
"""Styles a made-up band plays. Chosen by hand."""
