"""What is fresh, stale or missing, by content: the one place that decides what has to run.

Every stored partition's stamp is compared with what it would be made from now: code version, settings, versions of its
inputs. Inputs count by content, so an upstream rebuild with equal bytes leaves what follows fresh. The command, the
sensor, the schedule and ``odori status`` all ask here.
"""

import dataclasses
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import dagster as dg

from assets.dancing.characters import character_version
from assets.dancing.methods import ALTERNATIVES, METHODS
from assets.declare import KEEPS_KEY, METHODS_KEY, ONLY_FOR_KEY, SETTINGS_KEY, SOURCES_KEY
from assets.sources import sources as source_kinds
from assets.sources.sources import Sources
from assets.stamps import Stamp, version_of
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder
from pipelines.studio.lake import Lake
from schemas.keys import base_method

STAGE_IO_MANAGER = "stage"
ON_DEMAND = ("search",)
"""Groups of assets that are made when first needed, and kept up to date from then on."""
Kind = Literal["session", "song", "dance", "whole"]
State = Literal["fresh", "stale", "missing", "waiting"]


@dataclass(frozen=True)
class Node:
    """One asset as freshness sees it.

    ``together`` are the assets made in the same pass, itself included. ``methods`` are the methods of dancing it is
    made by, where there are several: each has a version and reads some of the inputs and settings. ``only_for`` is the
    one method an asset is made for, where there is one. ``keeps``: once made it stays when its inputs change.
    """

    name: str
    group: str
    kind: Kind
    code_version: str
    inputs: tuple[str, ...]
    settings: tuple[str, ...]
    sources: str
    together: tuple[str, ...]
    writes_stages: bool = False
    methods: Mapping[str, Mapping[str, Any]] = dataclasses.field(default_factory=dict)
    only_for: str = ""
    keeps: bool = False

    def inputs_of(self, key: str) -> list[str]:
        """List the inputs that a partition is made from: those its method reads, and those no method names."""
        return self._read(self.inputs, "inputs", key)

    def settings_of(self, key: str) -> list[str]:
        """List the settings that a partition is made with: those its method reads, and those no method names."""
        return self._read(self.settings, "settings", key)

    def code_version_of(self, key: str) -> str:
        """Version of the code a partition is made by: its method's, where it has one."""
        method = self.methods.get(base_method(key.split("|")[-1]))
        return str(method["version"]) if method else self.code_version

    def _read(self, names: Sequence[str], kind: str, key: str) -> list[str]:
        own = self.methods.get(base_method(key.split("|")[-1]))
        if own is None:
            return list(names)
        of_others = {name for method in self.methods.values() for name in method[kind]} - set(own[kind])
        return [name for name in names if name not in of_others]


@dataclass(frozen=True)
class PartitionState:
    """State of one partition of one asset, and why."""

    asset: str
    key: str
    state: State
    why: str = ""


def nodes(assets: Iterable[dg.AssetsDefinition]) -> dict[str, Node]:
    """Read the asset graph, in an order in which inputs come first."""
    found: dict[str, Node] = {}
    for definition in assets:
        together = tuple(sorted(key.to_user_string() for key in definition.keys))
        for spec in definition.specs:
            found[spec.key.to_user_string()] = Node(
                spec.key.to_user_string(),
                spec.group_name or "",
                _kind(spec.partitions_def),
                spec.code_version or "",
                tuple(sorted(dep.asset_key.to_user_string() for dep in spec.deps)),
                tuple(str(spec.metadata.get(SETTINGS_KEY, "")).split()),
                str(spec.metadata.get(SOURCES_KEY, "")),
                together,
                definition.get_io_manager_key_for_asset_key(spec.key) == STAGE_IO_MANAGER,
                _plain(spec.metadata.get(METHODS_KEY, {})),
                str(spec.metadata.get(ONLY_FOR_KEY, "")),
                KEEPS_KEY in spec.metadata,
            )
    ordered: dict[str, Node] = {}
    while len(ordered) < len(found):
        ready = [n for n in found.values() if n.name not in ordered and all(i in ordered for i in n.inputs)]
        ordered |= {n.name: n for n in ready}
    return ordered


def _plain(value: Any) -> Any:  # noqa: ANN401 - as an asset declares it, or as Dagster wraps it
    return getattr(value, "value", value)


def _kind(partitions: dg.PartitionsDefinition | None) -> Kind:
    if isinstance(partitions, dg.MultiPartitionsDefinition):
        return "dance"
    if isinstance(partitions, dg.DynamicPartitionsDefinition):
        return "song" if partitions.name == "song" else "session"
    return "whole"


class Freshness:
    """States of a studio's assets.

    Parameters
    ----------
    assets : nodes by name, inputs first
    lake, studio : where results and sources are
    """

    def __init__(self, assets: Mapping[str, Node], lake: Lake, studio: StudioFolder) -> None:
        self.assets = assets
        self._lake = lake
        self._studio = studio
        self._stamps: dict[tuple[str, str], Stamp | None] = {}
        self._asked: set[str] = set()
        self._prepared: set[str] = set()

    def ask(self, group: str) -> None:
        """Count the assets of a group made on demand among those there should be."""
        self._asked.add(group)

    @cached_property
    def sources(self) -> Sources:
        """The sources as they were when first read.

        Raises
        ------
        StudioError
            If all clips are gone that were there, or the folder of the songs is: a share that is not mounted must not
            cost the catalogue.
        """
        found = self._studio.sources()
        n_sessions, n_songs = len(self._lake.keys("clip")), len(self._lake.keys("song"))
        if n_sessions and not found.clips:
            raise StudioError(
                f"{self._studio.root / 'clips'}: want the clips that were there ({n_sessions} sessions stored), got "
                "none; bring them back (is the share mounted?), or delete the lake folder to start afresh"
            )
        if n_songs and not (self._studio.root / "songs").is_dir():
            raise StudioError(
                f"{self._studio.root / 'songs'}: want the folder of the songs ({n_songs} stored), got none; bring it "
                "back (is the share mounted?), or make an empty one"
            )
        return found

    def prepare(self, key: str) -> None:
        """Count a dance as asked for, here alone: what it is chosen from is there to be made, nothing is remembered.

        Parameters
        ----------
        key : ``<song>|<method>``
        """
        self._prepared.add(key)

    def forget(self) -> None:
        """Look at the lake anew."""
        self._stamps.clear()

    def stamp(self, asset: str, key: str) -> Stamp | None:
        """Stamp of a stored partition, read once."""
        if (asset, key) not in self._stamps:
            self._stamps[asset, key] = self._lake.stamp(asset, key)
        return self._stamps[asset, key]

    def partitions(self, asset: str) -> list[str]:
        """Partitions of an asset there should be; of what only dances are made from, those of songs danced so."""
        node = self.assets[asset]
        if node.group in ON_DEMAND and not self._is_asked(node.group):
            return []
        found = self.keys(node.kind)
        if node.only_for and not self.is_used(node.only_for):
            return []
        if node.group != "dance" or node.kind != "song":
            return found
        danced = {k.split("|")[0] for k in self.keys("dance") if asset in self.needed_for(k)}
        return [key for key in found if key in danced | set(self._lake.keys(asset))]

    def _is_asked(self, group: str) -> bool:
        return group in self._asked or any(self._lake.keys(n.name) for n in self.assets.values() if n.group == group)

    def is_used(self, method: str) -> bool:
        """Whether a method is used: a dance by it was asked for, or there are performances for it to learn from."""
        danced = any(base_method(key.split("|")[-1]) == method for key in self.keys("dance"))
        return danced or (METHODS[method].learns and bool(self.sources.performed_songs))

    def needed_for(self, key: str) -> set[str]:
        """Assets a dance is made from, its own included: those of the other methods are not."""
        found: set[str] = set()
        for node in reversed(list(self.assets.values())):
            if node.kind == "dance" or node.name in found:
                found |= {node.name, *node.inputs_of(key)}
        return found

    def keys(self, kind: Kind) -> list[str]:
        """Partitions there should be; of dances, those requested so far."""
        if kind == "session":
            return list(self.sources.sessions())
        if kind == "song":
            return list(self.sources.songs_by_key())
        if kind == "dance":
            songs = set(self.keys("song"))
            asked = {*self._studio.requests(), *self._lake.keys("choreography"), *self._prepared}
            return sorted(k for k in asked if k.split("|")[0] in songs)
        return [""]

    def settings_version(self, asset: str, key: str = "") -> str:
        """Version of the settings an asset reads for a partition."""
        settings = dataclasses.asdict(self._studio.settings())
        node = self.assets[asset]
        read = {}
        for name in node.settings_of(key):
            section, _, one = name.partition(".")
            read[name] = settings[section][one] if one else settings[section]
        return source_kinds.fingerprint(read)

    def source_version(self, asset: str, key: str) -> str:
        """Version of the source files an asset reads; empty when it reads none."""
        kind = self.assets[asset].sources
        if kind == "clips":
            return source_kinds.session_version(self.sources.sessions().get(key, ()))
        if kind == "song":
            songs = self.sources.songs_by_key().get(key, ())
            brief = source_kinds.brief_version(self._studio, songs)
            return version_of(source_kinds.song_version(songs), brief)
        if kind == "request":
            return source_kinds.request_version(self._studio, key, self.sources)
        if kind == "character":
            return character_version(self._studio, key, self.sources)
        return ""

    def inputs(self, asset: str, key: str) -> dict[str, str] | None:
        """Versions an asset's partition would be made from now; None while an input is not there.

        What reads every session or song reads those that there are: one that cannot be made stops no other.
        """
        node = self.assets[asset]
        versions = {}
        for name in node.inputs_of(key):
            of = self.assets[name].kind
            stamps = [(k, self.stamp(name, k)) for k in self._input_keys(node.kind, of, name, key)]
            if self._reads_every(node.kind, of):
                stamps = [(k, stamp) for k, stamp in stamps if stamp is not None]
            if any(stamp is None for _, stamp in stamps):
                return None
            versions[name] = version_of(*(f"{k}:{stamp.content}" for k, stamp in stamps if stamp))
        return versions

    @staticmethod
    def _reads_every(kind: Kind, of: Kind) -> bool:
        """Whether an asset of one kind reads all partitions of another, not its own."""
        return of != "whole" and of != kind and not (kind == "dance" and of == "song")

    def input_pairs(self, asset: str, key: str) -> set[tuple[str, str]]:
        """List the partitions that a partition is made from, as (asset, partition)."""
        node = self.assets[asset]
        return {
            (name, k)
            for name in node.inputs_of(key)
            for k in self._input_keys(node.kind, self.assets[name].kind, name, key)
        }

    def asked_version(self, assets: Collection[str], key: str) -> str:
        """Version of all that is asked of a partition of assets made in one run, and of what they are made from.

        What one of them is made from that another makes is left out: the version is the same before and after the run.
        It stays as long as code, settings, request, sources and inputs stay, whatever became of the run.
        """
        told = []
        for asset in sorted(assets):
            outside = sorted(pair for pair in self.input_pairs(asset, key) if pair[0] not in assets)
            inputs = [[*pair, stamp.content if (stamp := self.stamp(*pair)) else ""] for pair in outside]
            told.append(
                [
                    asset,
                    self.assets[asset].code_version_of(key),
                    self.settings_version(asset, key),
                    self.source_version(asset, key),
                    inputs,
                ]
            )
        return source_kinds.fingerprint([key, told])

    def _input_keys(self, kind: Kind, of: Kind, name: str, key: str) -> Sequence[str]:
        if of == "whole":
            return [""]
        if of == kind:
            return [key]
        if kind == "dance" and of == "song":
            return [key.split("|")[0]]
        return self.keys(of)

    def state(self, asset: str, key: str, *, pending: Iterable[tuple[str, str]] = ()) -> PartitionState:
        """State of one partition; ``pending`` are partitions known not to be fresh."""
        node = self.assets[asset]
        inputs = self.inputs(asset, key)
        waits = set(pending)
        for name in node.inputs_of(key):
            if any((name, k) in waits for k in self._input_keys(node.kind, self.assets[name].kind, name, key)):
                return PartitionState(asset, key, "waiting", f"{name} has to be made first")
        if inputs is None:
            return PartitionState(asset, key, "waiting", "an input has to be made first")
        stamp = self.stamp(asset, key)
        if stamp is None:
            return PartitionState(asset, key, "missing", "never made")
        if stamp.code_version != node.code_version_of(key):
            now = node.code_version_of(key)
            return PartitionState(asset, key, "stale", f"code version {stamp.code_version} is now {now}")
        if stamp.settings != self.settings_version(asset, key):
            return PartitionState(asset, key, "stale", f"settings [{'], ['.join(node.settings_of(key))}] changed")
        expected = ({} if node.keeps else inputs) | (
            {"sources": self.source_version(asset, key)} if node.sources else {}
        )
        changed = sorted(name for name in expected if stamp.inputs.get(name) != expected[name])
        if changed:
            return PartitionState(asset, key, "stale", f"{', '.join(changed)} changed")
        if node.writes_stages:
            lost = self._studio.lost_stages(*key.split("|"))
            if lost:
                return PartitionState(asset, key, "stale", f"{', '.join(lost)} is not there any more")
        return PartitionState(asset, key, "fresh")

    def is_danced(self, key: str) -> bool:
        """Whether every part of a dance is up to date with its request."""
        return all(self.state(n.name, key).state == "fresh" for n in self.assets.values() if n.kind == "dance")

    def findings(
        self,
        groups: Iterable[str] | None = None,
        *,
        given_up: Collection[tuple[str, str]] = (),
        keys: Callable[[str, str], bool] | None = None,
    ) -> list[PartitionState]:
        """State of every partition of every asset, or of some groups, inputs first.

        ``given_up`` are partitions that could not be made, ``keys`` says of (kind, key) which are to be made at all:
        nothing waits for the others.
        """
        wanted = set(groups) if groups is not None else None
        found: list[PartitionState] = []
        pending: set[tuple[str, str]] = set()
        for node in self.assets.values():
            for key in self.partitions(node.name):
                finding = self.state(node.name, key, pending=pending)
                is_coming = (keys is None or keys(node.kind, key)) and (node.name, key) not in given_up
                if finding.state != "fresh" and is_coming:
                    pending.add((node.name, key))
                if wanted is None or node.group in wanted:
                    found.append(finding)
        return found

    def orphans(self) -> list[tuple[str, str]]:
        """List stored partitions whose source is gone."""
        found = []
        for node in self.assets.values():
            if node.kind in ("session", "song"):
                wanted = set(self.keys(node.kind))
                found += [(node.name, k) for k in self._lake.keys(node.name) if k not in wanted]
            if node.kind == "dance":
                songs = set(self.keys("song"))
                found += [
                    (node.name, k)
                    for k in self._lake.keys(node.name)
                    if k.split("|")[0] not in songs or k.split("|")[-1] not in (*METHODS, *ALTERNATIVES)
                ]
        return found
