"""What a studio's files and partitions are: read or refused, fresh or not, and why."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pipelines import build
from pipelines.collection import freshness
from pipelines.commands import device_report
from pipelines.commands.dance_report import not_as_wanted
from pipelines.commands.outcome import DONE, SOME_REFUSED, Outcome
from pipelines.freshness import Freshness, PartitionState
from pipelines.studio.folder import StudioFolder, existing
from pipelines.studio.inventory import clips_and_doubts, songs_found

LONGEST_LIST = 40
"""Lines. Chosen by hand, to fit on a screen."""


def studio_status(root: Path, *, devices: bool = False) -> Outcome:
    """Say what is fresh, stale, failed or refused; of the devices too, for which no studio is needed."""
    if devices:
        of_devices = device_report.report(root)
        if not root.is_dir():
            return of_devices
        found = studio_status(root)
        return Outcome(
            max(found.status, of_devices.status),
            found.facts | of_devices.facts,
            f"{found.report}\n{of_devices.report}",
            [*found.troubles, *of_devices.troubles],
        )
    studio = existing(root)
    state = freshness(studio)
    (clips, doubts), songs = clips_and_doubts(state.sources, studio.lake), songs_of(state, studio)
    findings = state.findings()
    unmade = {(f.asset, f.key) for f in findings if f.state in ("stale", "missing")}
    is_begun = studio.dagster_home.is_dir()
    failures = build.last_failures(build.open_instance(studio), state, unmade) if is_begun else {}
    assets = [_asset_facts(f, state, failures) for f in findings]
    refused = [f for f in (*clips, *songs) if f["state"] == "refused"]
    dances = _dances(studio)
    notes = list(state.sources.notes)
    facts = {"clips": clips, "songs": songs, "assets": assets, "notes": notes, "warnings": doubts}
    facts["dances"] = dances
    report = _status_report(studio, clips, songs, assets, refused, notes, doubts)
    unwanted = [f"  not as wanted: {d['song']}|{d['method']}: {s}" for d in dances for s in d["not_as_wanted"]]
    report = "\n".join([report, *unwanted[:LONGEST_LIST], *_more(unwanted)])
    return Outcome(SOME_REFUSED if refused or unwanted else DONE, facts, report)


def _dances(studio: StudioFolder) -> list[dict[str, Any]]:
    """List the finished dances, and what keeps each from being as wanted."""
    found = []
    for key in studio.lake.keys("usd_animation"):
        song, method = key.split("|")
        try:
            report = json.loads((studio.dances_of(song) / f"{method}.json").read_bytes())
            told = not_as_wanted(report)
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            told = [f"its report {method}.json cannot be read ({error}); dance the song again"]
        found.append({"song": song, "method": method, "as_wanted": not told, "not_as_wanted": told})
    return found


def _asset_facts(finding: PartitionState, state: Freshness, failures: Mapping[tuple[str, str], str]) -> dict[str, Any]:
    failure = failures.get((finding.asset, finding.key))
    return {
        "asset": finding.asset,
        "partition": finding.key,
        "group": state.assets[finding.asset].group,
        "state": "failed" if failure else finding.state,
        "why": failure or finding.why,
    }


def _status_report(
    studio: StudioFolder,
    clips: list[dict[str, Any]],
    songs: list[dict[str, Any]],
    assets: list[dict[str, Any]],
    refused: list[dict[str, Any]],
    notes: list[str],
    doubts: list[dict[str, str]],
) -> str:
    lines = [f"studio {studio.root}"]
    for name, files in (("clips", clips), ("songs", songs)):
        by_state = counts(files)
        lines.append(
            f"  {name}: " + ", ".join(f"{n} {state}" for state, n in by_state.items() if n) + ("" if files else "none")
        )
    unfresh = [a for a in assets if a["state"] != "fresh"]
    lines.append(f"  assets: {len(assets) - len(unfresh)} partitions fresh, {len(unfresh)} not")
    unmade = _unmade(unfresh)
    lines += unmade[:LONGEST_LIST] + _more(unmade)
    lines += [f"  {line}" for line in refusals(refused)]
    doubtful = [f"  warning: {doubt['path']}: {doubt['warning']}" for doubt in doubts]
    lines += doubtful[:LONGEST_LIST] + _more(doubtful)
    lines += [f"  note: {note}" for note in notes]
    return "\n".join(lines)


def _unmade(assets: Iterable[dict[str, Any]]) -> list[str]:
    """Say what is not fresh, partitions that are so for one reason in one line."""
    alike: dict[tuple[str, str, str], list[str]] = {}
    for facts in assets:
        alike.setdefault((facts["state"], facts["asset"], facts["why"]), []).append(facts["partition"])
    lines: list[str] = []
    for (condition, asset, why), keys in alike.items():
        which = ", ".join(keys[:3]) + (f" and {len(keys) - 3} more" if len(keys) > 3 else "")
        lines.append(f"    {condition}: {asset}[{which}]: {why}")
    return lines


def clips_of(state: Freshness, studio: StudioFolder) -> list[dict[str, Any]]:
    """Every motion file with its state; "new" before it was looked at, "changed" where it was since."""
    return clips_and_doubts(state.sources, studio.lake)[0]


def songs_of(state: Freshness, studio: StudioFolder) -> list[dict[str, Any]]:
    """List every music file with its state."""
    return songs_found(state.sources, studio.lake)


def counts(files: list[dict[str, Any]]) -> dict[str, int]:
    """Count the files in each state."""
    return {state: sum(f["state"] == state for f in files) for state in ("read", "refused", "new", "changed")}


def any_read(*lists: list[dict[str, Any]]) -> bool:
    """Whether one file at least could be read."""
    return any(f["state"] == "read" for files in lists for f in files)


def refusals(refused: list[dict[str, Any]]) -> list[str]:
    """Say which files are refused, a line each."""
    return [f"refused: {f['path']}: {f['reason']}" for f in refused]


def _more(items: Sequence[object]) -> list[str]:
    return [f"    … and {len(items) - LONGEST_LIST} more"] if len(items) > LONGEST_LIST else []
