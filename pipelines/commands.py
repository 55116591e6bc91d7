"""What the command does: the report for a person, the facts for a machine, the exit status."""

import difflib
from collections.abc import Callable, Container, Iterable, Sequence
from pathlib import Path
from typing import Any

from sqlalchemy.exc import DBAPIError

from assets.formats.errors import FormatError
from assets.lineage import Progress
from assets.motion import beat_settings
from assets.partitions import ALTERNATIVES, METHODS, MOST_ALTERNATIVES, base_method
from assets.sources import Request, Song
from kernels.skeleton.canonical import JOINTS
from pipelines import build as building
from pipelines import casting, dancing, proposing
from pipelines import why as explaining
from pipelines.collection import freshness
from pipelines.definitions import build_definitions
from pipelines.devices import DeviceError, Devices, to_standard_error
from pipelines.files import LakeError, StudioError
from pipelines.freshness import Freshness
from pipelines.outcome import DONE, NOTHING_DONE, SOME_REFUSED, Outcome
from pipelines.resources import StudioFolder
from pipelines.search import by_likeness
from pipelines.status import any_read, clips_of, counts, refusals, songs_of
from pipelines.web import existing
from schemas.pins import parse_pin


class Session:
    """A studio opened for work: held, tidied, its definitions loaded."""

    def __init__(self, studio: StudioFolder, progress: Callable[[], Any]) -> None:
        self.studio = studio
        self.notes: list[str] = []
        """What the person who waits was told: which device failed, what is slow and why."""
        self.devices = Devices(studio.settings().opencl.device, say=self._say)
        check_settings(studio, self.devices)
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
                definitions = build_definitions(self.studio, progress=bar, devices=self.devices)
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

    def _say(self, line: str) -> None:
        self.notes.append(line)
        to_standard_error(line)


def check_settings(studio: StudioFolder, devices: Devices) -> None:
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
        try:
            devices.in_use()
        except DeviceError as error:
            raise FormatError("odori.toml", 0, str(error.args[0])) from error


def build(root: Path, *, dances: bool, progress: Callable[[], Any]) -> Outcome:
    """Bring a studio up to date."""
    studio = existing(root)
    work = Session(studio, progress)
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
        "notes": [*sources.notes, *work.notes],
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
    character: str = "",
    temperature: float | None = None,
    seed: int = 0,
) -> Outcome:
    """Dance songs, building first what they need and nothing else; by their briefs' methods where none is given."""
    studio = existing(root)
    if method is not None and method not in METHODS:
        raise StudioError(f"--method: want one of {', '.join(METHODS)}, got {method!r}")
    if out is not None:
        dancing.check_out(out)
    pins = _pin_texts(pins, root, progress)
    if temperature is not None and not 0 <= temperature <= 10:
        raise StudioError(f"--temperature: want 0 to 10, got {temperature:g}")
    if not 1 <= alternatives <= MOST_ALTERNATIVES:
        raise StudioError(f"--alternatives: want 1 to {MOST_ALTERNATIVES}, got {alternatives}")
    work = Session(studio, progress)
    songs = _wanted(work.state, wanted, studio)
    character = casting.named(studio, work.state.sources, character)
    if out is not None and len(songs) > 1:
        raise StudioError(f"--out: want one song, got {len(songs)}; leave it out, the dances are under {studio.dances}")
    methods = {song.key: _ways(method or _briefed_method(studio, song), alternatives) for song in songs}
    keys = {f"{song}|{chosen}" for song, ways in methods.items() for chosen in ways}
    if temperature is not None and not any(key.endswith("|hmm") for key in keys):
        raise StudioError("--temperature: want the method hmm, which draws dances, got another; add --method hmm")
    before = studio.requests()
    for key in sorted(keys):
        studio.remember(key, Request(frame_rate_hz or 0.0, pins, character, temperature, seed))
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
            made.append(dancing.facts_of(studio, song.key, way))
    if out is not None and made:
        dancing.copy_out(made[0], out)
    told = tuple(f"[{song}{end}" for song in refused for end in "|]")  # a refused song's dance failed, of course
    troubles += [f"failed: {f}" for f in report.failed if not f.startswith(told)]
    troubles = list(dict.fromkeys(troubles))
    status = DONE if not troubles else SOME_REFUSED if made else NOTHING_DONE
    facts = dancing.dances_facts(made, troubles, len(keys)) | {"notes": work.notes}
    if not made:
        facts |= next((dict(t.facts) for t in report.troubles if "conflict" in t.facts), {})
    return Outcome(status, facts, "\n".join(dancing.report_of(d) for d in made), troubles)


def propose(
    root: Path,
    wanted: str,
    place: str,
    *,
    pins: Sequence[str] = (),
    progress: Callable[[], Any],
) -> Outcome:
    """List what could be pinned at a place of a song, building first what that takes; nothing is danced."""
    studio = existing(root)
    pins = _pin_texts(pins, root, progress)
    work = Session(studio, progress)
    songs = _wanted(work.state, [wanted], studio)
    if len(songs) > 1:
        raise StudioError(f"--propose: want one song, got {len(songs)}")
    key = f"{songs[0].key}|{METHODS[0]}"
    needed = {name for name in work.state.needed_for(key) if work.state.assets[name].kind != "dance"}
    report = work.run(building.GROUPS, keys=lambda kind, one: kind != "song" or one == songs[0].key, assets=needed)
    try:
        return proposing.propose(studio, songs[0].key, place, pins)
    except LakeError as error:
        raise StudioError("; ".join([str(error), *report.failed])) from error


def _pin_texts(pins: Sequence[str], root: Path, progress: Callable[[], Any]) -> tuple[str, ...]:
    """Check pins of the command line, those by likeness turned into clips; StudioError says what a pin looks like."""
    named = [by_likeness(root, text, progress=progress) for text in pins]
    try:
        return tuple(dict.fromkeys(parse_pin(text).text for text in named))
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


def why(root: Path, danced: str, *, at_s: float | None) -> Outcome:
    """Say where a moment of a dance comes from, or where all of it does; a stage answers without a studio."""
    if danced.lower().endswith(explaining.STAGE_SUFFIXES):
        return explaining.why(explaining.from_stage(Path(danced)), at_s)
    studio = existing(root)
    state = freshness(studio)
    text, bar, method = danced.partition("|")
    song = _wanted(state, [text], studio)[0]
    key = explaining.find_dance(studio, f"{song.key}{bar}{method}", _briefed_method(studio, song))
    return explaining.why(explaining.from_lake(studio, key), at_s)


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
