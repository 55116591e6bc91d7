"""What the command does: the report for a person, the facts for a machine, the exit status."""

import difflib
import json
import shutil
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import polars as pl
from sqlalchemy.exc import DBAPIError

from assets.formats import usd_package
from assets.formats.errors import FormatError
from assets.lineage import Progress
from assets.motion import beat_settings
from assets.partitions import ALTERNATIVES, METHODS, MOST_ALTERNATIVES, base_method
from assets.sources import Request, Song
from kernels.skeleton.canonical import JOINTS
from pipelines import build as building
from pipelines import hmm_report
from pipelines.collection import freshness
from pipelines.definitions import build_definitions
from pipelines.files import StudioError, write_beside
from pipelines.freshness import Freshness
from pipelines.outcome import DONE, NOTHING_DONE, SOME_REFUSED, Outcome
from pipelines.resources import StudioFolder
from pipelines.status import any_read, clips_of, counts, refusals, songs_of
from pipelines.web import existing
from schemas.pins import parse_pin


class _Session:
    """A studio opened for work: held, tidied, its definitions loaded."""

    def __init__(self, studio: StudioFolder, progress: Callable[[], Any]) -> None:
        self.studio = studio
        check_settings(studio)
        self.state = freshness(studio)
        self._progress = progress

    def run(
        self,
        groups: Iterable[str],
        *,
        keys: Callable[[str, str], bool] | None = None,
        assets: Container[str] | None = None,
    ) -> building.Report:
        """Bring groups of assets, or some assets of them, up to date."""
        bar: Progress = self._progress()
        try:
            with building.exclusive(self.studio):
                instance = building.open_instance(self.studio)
                building.clear_after_kill(self.studio, instance)
                definitions = build_definitions(self.studio, progress=bar)
                return building.bring_up_to_date(
                    self.studio, definitions, instance, self.state, groups=groups, keys=keys, assets=assets
                )
        except DBAPIError as error:  # what was stored before is whole: tables are written beside and renamed
            place = self.studio.dagster_home
            raise StudioError(
                f"{place}: Dagster's storage refused: {error.orig}; free some space or mend it"
            ) from error
        finally:
            if hasattr(bar, "close"):
                bar.close()


def check_settings(studio: StudioFolder) -> None:
    """Refuse settings before anything runs; FormatError naming the key."""
    settings = studio.settings()
    try:
        beat_settings(settings.motion_beat)
    except ValueError as error:
        raise FormatError("odori.toml", 0, f"[motion_beat] {error}") from error
    for source, joint in settings.joints.items():
        if joint not in JOINTS:
            near = difflib.get_close_matches(joint, JOINTS, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"they are {', '.join(JOINTS)}"
            raise FormatError("odori.toml", 0, f"[joints] {source!r}: want a canonical joint, got {joint!r}; {hint}")
    if settings.opencl.device:
        from kernels.opencl.device import NoDeviceError, pick_device

        try:
            pick_device(settings.opencl.device)
        except NoDeviceError as error:
            raise FormatError("odori.toml", 0, f"[opencl] {error}") from error


def build(root: Path, *, dances: bool, progress: Callable[[], Any]) -> Outcome:
    """Bring a studio up to date."""
    studio = existing(root)
    work = _Session(studio, progress)
    sources = work.state.sources
    if not sources.clips and not sources.songs:
        raise StudioError(f"{root}: want clips under clips/ and songs under songs/, got none; put some there")
    groups = building.GROUPS if dances else [g for g in building.GROUPS if g != "dance"]
    report = work.run(groups)
    clips, songs = clips_of(work.state, studio), songs_of(work.state, studio)
    refused = [f for f in (*clips, *songs) if f["state"] == "refused"]
    facts = {
        "clips": counts(clips),
        "songs": counts(songs),
        "refused": [{"path": f["path"], "reason": f["reason"]} for f in refused],
        "ran": [{"assets": list(b.assets), "partitions": list(b.keys)} for b in report.ran],
        "failed": report.failed,
        "notes": list(sources.notes),
    }
    troubles = [*refusals(refused), *(f"failed: {f}" for f in report.failed), *(f"note: {n}" for n in sources.notes)]
    status = (
        NOTHING_DONE
        if report.failed and not any_read(clips, songs)
        else SOME_REFUSED
        if refused or report.failed
        else DONE
    )
    return Outcome(status, facts, _build_report(facts, studio), troubles)


def _build_report(facts: dict[str, Any], studio: StudioFolder) -> str:
    clips, songs = facts["clips"], facts["songs"]
    made = sum(len(batch["partitions"]) for batch in facts["ran"])
    work = f"{made} partitions made" if made else "everything was up to date"
    refused = clips["refused"] + songs["refused"]
    return (
        f"{clips['read']} clips and {songs['read']} songs read, {refused} files refused; {work}\n"
        f"next: odori dance SONG --studio {studio.root}, or odori ui --studio {studio.root}"
    )


def dance(
    root: Path,
    wanted: Sequence[str],
    *,
    method: str | None = None,
    frame_rate_hz: float | None,
    out: Path | None,
    progress: Callable[[], Any],
    pins: Sequence[str] = (),
    alternatives: int = 1,
    temperature: float | None = None,
    seed: int = 0,
) -> Outcome:
    """Dance songs, building first what they need and nothing else; by their briefs' methods where none is given."""
    studio = existing(root)
    if method is not None and method not in METHODS:
        raise StudioError(f"--method: want one of {', '.join(METHODS)}, got {method!r}")
    if out is not None:
        _check_out(out)
    pins = _pin_texts(pins)
    if temperature is not None and not 0 <= temperature <= 10:
        raise StudioError(f"--temperature: want 0 to 10, got {temperature:g}")
    if not 1 <= alternatives <= MOST_ALTERNATIVES:
        raise StudioError(f"--alternatives: want 1 to {MOST_ALTERNATIVES}, got {alternatives}")
    work = _Session(studio, progress)
    songs = _wanted(work.state, wanted, studio)
    if out is not None and len(songs) > 1:
        raise StudioError(f"--out: want one song, got {len(songs)}; leave it out, the dances are under {studio.dances}")
    methods = {song.key: _ways(method or _briefed_method(studio, song), alternatives) for song in songs}
    keys = {f"{song}|{chosen}" for song, ways in methods.items() for chosen in ways}
    before = studio.requests()
    for key in sorted(keys):
        studio.remember(key, Request(frame_rate_hz or 0.0, pins, temperature, seed))
    names = {song.key for song in songs}
    if any(base_method(chosen) == "hmm" for ways in methods.values() for chosen in ways):
        names |= work.state.sources.performed_songs  # what the dancer danced to is what the model learns from
    report = work.run(
        building.GROUPS,
        keys=lambda kind, key: key in keys if kind == "dance" else key in names if kind == "song" else True,
        assets=set().union(*(work.state.needed_for(key) for key in keys)),
    )
    state = freshness(studio)
    refused = {f["key"]: f["reason"] for f in songs_of(state, studio) if f["state"] == "refused"}
    made, troubles = [], []
    for song, way in [(one, way) for one in songs for way in methods[one.key]]:
        key = f"{song.key}|{way}"
        if refused.get(song.key):
            troubles.append(f"refused: {song.path}: {refused[song.key]}")
        elif not state.is_danced(key):
            troubles += [f"failed: {f}" for f in report.failed] or [f"failed: {song.path}"]
            studio.remember(key, before.get(key))  # what cannot be is not asked for again every night
        else:
            made.append(_dance_facts(studio, song.key, way))
    if out is not None and made:
        _copy(made[0], out)
    status = DONE if not troubles else SOME_REFUSED if made else NOTHING_DONE
    facts = _dance_json(made, troubles, len(keys))
    if not made:
        facts |= next((dict(t.facts) for t in report.troubles if "conflict" in t.facts), {})
    return Outcome(status, facts, "\n".join(_dance_report(d) for d in made), list(dict.fromkeys(troubles)))


def _pin_texts(pins: Sequence[str]) -> tuple[str, ...]:
    """Check pins of the command line; StudioError says what a pin looks like."""
    try:
        return tuple(dict.fromkeys(parse_pin(text).text for text in pins))
    except ValueError as error:
        raise StudioError(f"--pin: {error}") from error


def _ways(method: str, alternatives: int) -> tuple[str, ...]:
    """Name the dances to make of a method: itself, and its alternatives."""
    if alternatives > 1 and method != "graph":
        raise StudioError(f"--alternatives: want the method graph, which has them, got {method}")
    return (method, *ALTERNATIVES[: alternatives - 1])


def _briefed_method(studio: StudioFolder, song: Song) -> str:
    """Find the method a song's brief names; the usual one where the brief cannot be read (its song is refused)."""
    try:
        return studio.brief(song).method
    except FormatError:
        return METHODS[0]


def _dance_json(made: list[dict[str, Any]], troubles: list[str], n_asked: int) -> dict[str, Any]:
    if n_asked == 1:
        return made[0] if made else {"error": "; ".join(dict.fromkeys(troubles))}
    return {"dances": made, "troubles": list(dict.fromkeys(troubles))}


def _dance_facts(studio: StudioFolder, song: str, method: str) -> dict[str, Any]:
    folder = studio.dances / song
    report = json.loads((folder / f"{method}.json").read_text())
    model = hmm_report.model_facts(studio.lake) if method == "hmm" else None
    if model is not None:
        model["notes"] += hmm_report.dance_notes(report["wanted"])
    return {
        "song": song,
        "method": method,
        "stage": str(folder / f"{method}.usdc"),
        "usdz": str(folder / f"{method}.usdz"),
        "quality": report["quality"],
        "not_as_wanted": sorted(n for n, m in report["wanted"].items() if m["is_passed"] is False),
        "pins": _pin_facts(studio, f"{song}|{method}"),
        **({} if model is None else {"model": model}),
    }


def _pin_facts(studio: StudioFolder, key: str) -> list[dict[str, Any]]:
    """Tell for each pin when it is danced, by which clips, and whether it is kept."""
    steps = pl.DataFrame(studio.lake.table("choreography", key)).filter(pl.col("pin_id").is_not_null())
    if not len(steps):
        return []
    sessions = studio.lake.keys("clip")
    clips = {r["clip_id"]: r for s in sessions for r in studio.lake.table("clip", s).to_pylist()}
    facts = []
    for pin, rows in steps.group_by("pin_id", maintain_order=True):
        danced = list(dict.fromkeys(rows["clip_id"].to_list()))
        facts.append(
            {
                "pin": pin[0],
                "from_s": rows["song_start_s"].min(),
                "to_s": rows["song_end_s"].max(),
                "clips": danced,
                "is_kept": all(parse_pin(str(pin[0])).is_kept_by(**_named(clips[clip])) for clip in danced),
            }
        )
    return facts


def _named(clip: Mapping[str, Any]) -> dict[str, str]:
    return {"clip_id": str(clip["clip_id"]), "label": str(clip["label"]), "style": str(clip["style"])}


def _dance_report(facts: dict[str, Any]) -> str:
    q = facts["quality"]
    lines = [
        f"{facts['song']}: {facts['usdz']}",
        f"  {q['clip_count']:.0f} clips, {q['seam_count']:.0f} seams; beats at most {q['beat_lag_ms']:.1f} ms off; "
        f"warp {q['warp_least_ratio']:.2f} to {q['warp_most_ratio']:.2f}",
        f"  on the beat to an independent eye: F {q['beat_f_ratio']:.2f}, p {q['beat_p_probability']:.3f}",
    ]
    lines += [
        f"  pin {p['pin']}: {'kept' if p['is_kept'] else 'not kept'}, {', '.join(p['clips'])} "
        f"from {p['from_s']:.2f} to {p['to_s']:.2f} s"
        for p in facts["pins"]
    ]
    if facts["not_as_wanted"]:
        lines.append(f"  not as wanted: {', '.join(facts['not_as_wanted'])} (see the .json beside the stage)")
    if "model" in facts:
        lines += hmm_report.report_lines(facts["model"])
    return "\n".join(lines)


def _check_out(out: Path) -> None:
    """Refuse to copy to where a file of the user would be lost."""
    if out.suffix not in (".usdz", ".usdc"):
        raise StudioError(f"--out: want a file ending in .usdz or .usdc, got {out.name!r}")
    sound = out.with_suffix(".wav")
    if out.suffix == ".usdc" and sound.exists() and usd_package.song_name(out) != sound.name:
        raise StudioError(
            f"--out: want room for the song beside the stage, got another file {sound}; move it, or name another stage"
        )


def _copy(facts: dict[str, Any], out: Path) -> None:
    source = Path(facts["usdz" if out.suffix == ".usdz" else "stage"])
    facts["out"] = str(out)
    if out.resolve() == source.resolve():
        return
    if out.suffix == ".usdc":
        usd_package.copy_stage(out, source)
    else:
        with source.open("rb") as original:
            write_beside(out, lambda file: shutil.copyfileobj(original, file))


def _wanted(state: Freshness, wanted: Sequence[str], studio: StudioFolder) -> list[Song]:
    """Find songs by key, file name, stem or path; LookupError naming the nearest where there is none."""
    songs = {key: state.sources.song(key) for key in state.sources.songs_by_key()}
    if not songs:
        raise StudioError(f"{studio.root}: want a song under songs/, got none; put one there")
    if list(wanted) == ["all"]:
        return list(songs.values())
    found = []
    for text in wanted:
        name = Path(text).name
        hits = [
            s
            for s in songs.values()
            if text in (s.key, s.path)
            or name == Path(s.path).name
            or text == Path(s.path).stem
            or _same(studio, s, text)
        ]
        if not hits:
            near = difflib.get_close_matches(
                text, [*songs, *(Path(s.path).name for s in songs.values())], n=3, cutoff=0.3
            )
            raise StudioError(
                f"{text}: want a song of this studio, found none of that name; "
                f"{'near are ' + ', '.join(near) if near else 'there are ' + ', '.join(list(songs)[:10])}"
            )
        found.append(hits[0])
    return list(dict.fromkeys(found))


def _same(studio: StudioFolder, song: Song, text: str) -> bool:
    return Path(text).absolute() == studio.file(song.path)


def check(file: Path) -> Outcome:
    """Validate a stage."""
    from assets.formats import usd_check

    if not file.is_file():
        raise StudioError(f"{file}: want a stage, got no such file; check the path")
    findings = usd_check.check(file)
    errors = [f for f in findings if f.severity == "error"]
    facts = {
        "file": str(file),
        "is_valid": not errors,
        "findings": [
            {"severity": f.severity, "rule": f.rule, "prim": f.prim_path, "sentence": f.sentence} for f in findings
        ],
    }
    lines = [f"{f.severity}: {f.rule}: {f.prim_path}: {f.sentence}" for f in findings]
    verdict = f"{file}: {'valid' if not errors else f'{len(errors)} errors'}"
    return Outcome(SOME_REFUSED if errors else DONE, facts, "\n".join([*lines, verdict]))
