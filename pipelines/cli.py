"""The `odori` command: a convenience over the same jobs Dagster runs.

Each command prints a short report, or with ``--json`` exactly one object on standard output; logs and progress go to
standard error. Exit status: 0 done, 1 done but some inputs were refused, 2 nothing done.
"""

import os
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer

from pipelines.caches import settle
from pipelines.printing import NOTHING_DONE, Complaint, answer, finish, has_answered, say, settle_streams

# Nothing else of ours is imported here: --help answers at once, and main sets the environment before NumPy is loaded.
app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Keep a motion-capture catalogue analysed and ready to dance; make a song a dance in USD.",
    pretty_exceptions_enable=False,
)


def _examples(*lines: str) -> str:
    """Write examples one a line; the sign in front keeps the parser from running them together."""
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)


StudioOption = Annotated[
    Path | None,
    typer.Option("--studio", help="The studio folder. Left out: $ODORI_STUDIO, else ./studio.", show_default=False),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of the report.")]


def _say_version(is_asked: bool) -> None:
    if is_asked:
        sys.stdout.write(f"odori {version('odori')}\n")
        raise typer.Exit


@app.callback()
def odori(
    is_version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_say_version, is_eager=True)
    ] = False,
) -> None:
    """Take options that belong to no command."""


@app.command(epilog=_examples("odori demo"))
def demo(
    studio: Annotated[Path, typer.Option("--studio", help="Folder for the made-up studio.")] = Path("demo"),
    as_json: JsonOption = False,
) -> None:
    """Make up a studio and dance its song; needs no input."""
    from pipelines.commands import demo_studio

    with Complaint(as_json):
        demo_studio.make(studio)
        say(f"a made-up studio is in {studio}", as_json)
    _dance(studio, [demo_studio.SONG], "graph", None, None, as_json)


@app.command(epilog=_examples("odori build", "odori build --studio /shows/nagoya --dances"))
def build(
    studio: StudioOption = None,
    dances: Annotated[bool, typer.Option("--dances", help="Also make stale dances again.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Bring a studio's tables up to date.

    Only what changed is computed again.
    """
    from pipelines.commands.build_studio import build_studio

    with Complaint(as_json):
        result = build_studio(_folder(studio), dances=dances, progress=_progress())
        finish(result, as_json)


@app.command(
    epilog=_examples(
        "odori dance waltz.mp3",
        "odori dance all",
        "odori dance waltz --method matching",
        "odori dance waltz --pin 42=spin --pin 12.5-16=clip:KEY",
        "odori dance waltz --pin bar:9-12=style:salsa --pin start=not:walk",
        "odori dance waltz --propose 42",
        "odori dance waltz --pin 12=spin --propose bar:9-10",
        "odori dance waltz --alternatives 3",
        "odori dance waltz --character hero.usdz",
        "odori dance waltz --character ayame-step_01",
        "odori dance waltz --fps 60 --out /show/waltz.usdz",
        "odori dance groove.mid --method hmm --temperature 0.5 --seed 2",
    )
)
def dance(
    songs: Annotated[
        list[str], typer.Argument(metavar="SONG...", help="Key or file name of a song; several, or 'all'.")
    ],
    studio: StudioOption = None,
    method: Annotated[
        str | None,
        typer.Option(
            "--method", help="How steps are chosen: graph, matching or hmm. Left out: the brief's method, else graph."
        ),
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option("--fps", help="Frames a second of the stage. Left out: the settings'.", min=1.0, max=240.0),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Also copy the stage here: a .usdz or .usdc file.")] = None,
    pin: Annotated[
        list[str] | None,
        typer.Option(
            "--pin",
            metavar="PLACE=WISH",
            help="What to dance when, as 42=spin. A pin is kept, or the dance is refused with the reason.",
        ),
    ] = None,
    alternatives: Annotated[
        int,
        typer.Option("--alternatives", help="How many dances of each song to make: the best, and others unlike it."),
    ] = 1,
    character: Annotated[
        str,
        typer.Option(
            "--character",
            metavar="CLIP|FILE.usd",
            help="Whose body dances: a clip's, or a rigged character's. Left out: the brief's, else odori's mannequin.",
        ),
    ] = "",
    propose: Annotated[
        str | None,
        typer.Option(
            "--propose",
            metavar="PLACE",
            help="Make no dance: list what could be pinned at this place, and at what cost.",
        ),
    ] = None,
    temperature: Annotated[
        float | None,
        typer.Option(
            "--temperature",
            help="hmm only. 0: the most probable dance. 1: motions drawn at random by the model's probabilities.",
        ),
    ] = None,
    seed: Annotated[
        int,
        typer.Option(
            "--seed", help="hmm only. Number of the random draw: the same number gives the same dance.", min=0
        ),
    ] = 0,
    as_json: JsonOption = False,
) -> None:
    """Dance a song: a USD stage with the music in it.

    A song's brief, songs/NAME.brief.toml, keeps method, pins, licences and character for every rebuild; options given
    here come before it.
    """
    if propose is not None:
        _propose(studio, songs, propose, pin or (), as_json)
    _dance(
        studio,
        songs,
        method,
        fps,
        out,
        as_json,
        pins=pin or (),
        alternatives=alternatives,
        character=character,
        temperature=temperature,
        seed=seed,
    )


def _propose(studio: Path | None, songs: list[str], place: str, pins: Sequence[str], as_json: bool) -> None:
    from pipelines.commands.propose import propose_pins
    from pipelines.studio.files import StudioError

    with Complaint(as_json):
        if len(songs) != 1:
            raise StudioError(f"--propose: want one song, got {len(songs)}; ask for each alone")
        result = propose_pins(_folder(studio), songs[0], place, pins=pins, progress=_progress())
        finish(result, as_json)


def _dance(
    studio: Path | None,
    songs: list[str],
    method: str | None,
    fps: float | None,
    out: Path | None,
    as_json: bool,
    **more: Any,  # noqa: ANN401 - what else dance_songs takes
) -> None:
    from pipelines.commands.dance_songs import dance_songs

    with Complaint(as_json):
        result = dance_songs(
            _folder(studio), songs, method=method, frame_rate_hz=fps, out=out, progress=_progress(), **more
        )
        finish(result, as_json)


@app.command(
    epilog=_examples(
        "odori why waltz --at 12.34", "odori why 'waltz|graph_2'", "odori why dances/waltz/graph.usdz --at 12.34"
    )
)
def why(
    danced: Annotated[
        str,
        typer.Argument(metavar="DANCE", help="A song, 'SONG|METHOD', or a stage: .usdz or .usdc.", show_default=False),
    ],
    at: Annotated[float | None, typer.Option("--at", help="Second of the song. Left out: the whole dance.")] = None,
    studio: StudioOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say where a moment of a dance comes from, and why.

    It names clip, time, blend, warp and licence, and what the step costs. A stage carries its own lineage: asked about
    one, the command needs no studio.
    """
    from pipelines.commands.why import explain_dance

    with Complaint(as_json):
        finish(explain_dance(_folder(studio), danced, at_s=at), as_json)


@app.command(epilog=_examples("odori check dances/waltz/graph.usdz"))
def check(
    file: Annotated[Path, typer.Argument(metavar="FILE.usd[cz]", help="The stage to validate.")],
    as_json: JsonOption = False,
) -> None:
    """Validate a stage.

    USD's own validators are run, and what odori promises of its stages (docs/usd.md) is checked.
    """
    from pipelines.commands.check import check_stage

    with Complaint(as_json):
        finish(check_stage(file), as_json)


@app.command(
    epilog=_examples(
        "odori search ayame-step",
        "odori search ayame-step@2.5-4 -k 5 --style salsa",
        "odori search take.bvh",
        "odori search --like ayame-step --unlike kaede-kick --sheet hits.png",
    )
)
def search(
    clip: Annotated[
        str | None,
        typer.Argument(
            metavar="CLIP", help="A clip's key, CLIP@2.5-4 for a stretch of it, or a BVH file.", show_default=False
        ),
    ] = None,
    studio: StudioOption = None,
    k: Annotated[int, typer.Option("-k", help="How many clips to find.", min=1, max=1000)] = 10,
    label: Annotated[
        list[str] | None, typer.Option("--label", help="Only clips of this label; may be repeated.")
    ] = None,
    style: Annotated[list[str] | None, typer.Option("--style", help="Only clips of this style.")] = None,
    licence: Annotated[list[str] | None, typer.Option("--licence", help="Only clips of this licence.")] = None,
    min_seconds: Annotated[float, typer.Option("--min-seconds", help="Only clips at least this long.", min=0.0)] = 0.0,
    max_seconds: Annotated[
        float | None, typer.Option("--max-seconds", help="Only clips at most this long.", min=0.0)
    ] = None,
    like: Annotated[
        list[str] | None, typer.Option("--like", help="Move the search towards this clip; may be repeated.")
    ] = None,
    unlike: Annotated[
        list[str] | None, typer.Option("--unlike", help="Move the search away from this clip; may be repeated.")
    ] = None,
    sheet: Annotated[Path | None, typer.Option("--sheet", help="Draw query and hits as stick figures: a PNG.")] = None,
    train: Annotated[bool, typer.Option("--train", help="Train the encoder again, on the clips of today.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Find the clips most like a motion."""
    with Complaint(as_json):
        from pipelines.commands import search_motions

        wish = search_motions.MotionQuery(
            query=clip or "",
            k=k,
            label=label or (),
            style=style or (),
            licence=licence or (),
            min_seconds=min_seconds,
            max_seconds=float("inf") if max_seconds is None else max_seconds,
            like=like or (),
            unlike=unlike or (),
        )
        # The bar is made where something has to be: loading it loads Dagster.
        result = search_motions.search(_folder(studio), wish, sheet=sheet, train=train, progress=lambda: _progress()())
        finish(result, as_json)


@app.command(
    epilog=_examples(
        "odori clips",
        "odori clips waltz --not-method graph",
        "odori clips --state fenced --state refused",
        "odori clips --label spin --style salsa --method hmm",
        "odori clips --json",
    )
)
def clips(
    song: Annotated[
        str | None,
        typer.Argument(
            metavar="SONG", help="Danceable to this song: its licences and tempo count.", show_default=False
        ),
    ] = None,
    studio: StudioOption = None,
    label: Annotated[
        list[str] | None, typer.Option("--label", help="Only clips of this label; may be repeated.")
    ] = None,
    style: Annotated[
        list[str] | None, typer.Option("--style", help="Only clips of this style; may be repeated.")
    ] = None,
    state: Annotated[
        list[str] | None,
        typer.Option(
            "--state", help="Only clips in this state: read, refused, new, changed, mended, fenced or doubtful."
        ),
    ] = None,
    method: Annotated[
        str, typer.Option("--method", help="Only clips this method can dance: graph, matching or hmm.")
    ] = "",
    not_method: Annotated[
        str, typer.Option("--not-method", help="Only clips this method cannot dance, each with the reason.")
    ] = "",
    as_json: JsonOption = False,
) -> None:
    """List the clips: label, style, state, what is wrong, and which methods can dance them or why not.

    Nothing is built: what 'odori build' found is told. Faults and their verdicts: docs/clip-health.md.
    """
    from pipelines.commands.list_clips import ClipFilter, list_clips

    with Complaint(as_json):
        wanted = ClipFilter(label or (), style or (), state or (), method, not_method)
        finish(list_clips(_folder(studio), song, wanted), as_json)


@app.command(epilog=_examples("odori calibrate take.parquet", "odori calibrate take.csv --bvh take.bvh"))
def calibrate(
    recording: Annotated[Path, typer.Argument(metavar="RECORDING", help="A suit recording: .parquet or .csv.")],
    bvh: Annotated[Path | None, typer.Option("--bvh", help="Also write the motion as BVH here.")] = None,
    poses: Annotated[
        Path | None,
        typer.Option(
            "--poses", help="Where to write joint centres as Parquet. Left out: RECORDING.poses.parquet in this folder."
        ),
    ] = None,
    method: Annotated[
        str | None, typer.Option("--method", help="gauss_newton or springs. Left out: the setting's.")
    ] = None,
    iterations: Annotated[
        int | None, typer.Option("--iterations", help="Iterations of the method. 0: its usual number.")
    ] = None,
    studio: Annotated[
        Path | None,
        typer.Option(
            "--studio",
            help="A studio whose odori.toml is used. Left out: $ODORI_STUDIO, else none.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Calibrate a suit recording to bones and poses.

    The report says how sure each bone length is, and what to record again. No studio is needed.
    """
    with Complaint(as_json):
        from pipelines.commands import calibrate_recording

        result = calibrate_recording.calibrate(
            recording,
            studio=studio or (_folder(None) if "ODORI_STUDIO" in os.environ else None),
            bvh_out=bvh,
            poses_out=poses,
            method=method,
            iterations=iterations,
        )
        finish(result, as_json)


@app.command(epilog=_examples("odori status", "odori status --json", "odori status --devices"))
def status(
    studio: StudioOption = None,
    devices: Annotated[
        bool,
        typer.Option(
            "--devices", help="Also try every OpenCL device, and say which one computes and why; needs no studio."
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Say what is fresh, stale, failed or refused, and why."""
    from pipelines.commands.status import studio_status

    with Complaint(as_json):
        finish(studio_status(_folder(studio), devices=devices), as_json)


@app.command(epilog=_examples("odori ui", "odori ui --port 3001"))
def ui(
    studio: StudioOption = None,
    port: Annotated[int, typer.Option("--port", help="Port of the web page.")] = 3000,
    host: Annotated[str, typer.Option("--host", help="Address to listen on.")] = "127.0.0.1",
) -> None:
    """Serve Dagster's web UI on this studio.

    The sensor for new files and the nightly rebuild run along.
    """
    from pipelines import web

    with Complaint(False):
        raise typer.Exit(web.serve(_folder(studio), host=host, port=port))


def _folder(studio: Path | None) -> Path:
    return studio or Path(os.environ.get("ODORI_STUDIO", "studio"))


def _progress() -> Callable[[], Any]:
    """Make a progress bar on standard error, or nothing where that is no terminal."""
    from pipelines.commands.progress import Bar
    from pipelines.resources import NoProgress

    return Bar if sys.stderr.isatty() else NoProgress


def main() -> None:
    """Run the command; ``--json`` may stand anywhere, also last."""
    for library in ("OPENBLAS", "OMP", "MKL"):  # more threads change last bits: same inputs, same bytes
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    settle()
    settle_streams()
    try:
        app()
    except SystemExit as ended:
        if (
            ended.code == NOTHING_DONE and "--json" in sys.argv and not has_answered()
        ):  # a usage error, said by the parser
            answer({"error": "the command line is wrong; standard error says how"})
        raise


if __name__ == "__main__":
    main()
