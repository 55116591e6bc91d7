"""A failure belongs to what was asked: told as long as that is asked, and never as the reason for anything else."""

import dataclasses
import shutil

import dagster as dg
import pytest

from assets.sources.sources import Request
from pipelines import build as building
from pipelines.collection import freshness
from pipelines.commands.dance_songs import dance_songs
from pipelines.commands.status import studio_status
from pipelines.definitions import build_definitions
from pipelines.freshness import Freshness
from pipelines.resources import NoProgress
from pipelines.sensors import requests
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder

IMPOSSIBLE = '[[pin]]\nat = 4.0\nlabel = "no such thing"\n'
POSSIBLE = '[[pin]]\nat = 4.0\nlabel = "rock"\n'


@pytest.fixture
def dance(studio):
    """Dance a song of the small studio as it is asked for."""

    def run(song="beat", method="graph", **asked):
        return dance_songs(studio, [song], method=method, frame_rate_hz=None, out=None, progress=NoProgress, **asked)

    return run


@pytest.fixture
def brief(studio):
    """Write the brief of the song."""

    def write(text, song="beat"):
        (studio / "songs" / f"{song}.brief.toml").write_text(text)

    return write


@pytest.fixture
def remember(studio):
    """Keep what is asked of the dance by the graph, as the command does."""

    def keep(**asked):
        StudioFolder(studio).remember("beat|graph", Request(**asked))

    return keep


def told(root):
    """States of the choreographies, and why they are so."""
    found = [facts for facts in studio_status(root).facts["assets"] if facts["asset"] == "choreography"]
    return {facts["partition"]: (facts["state"], facts["why"]) for facts in found}


def last_run(root):
    return building.open_instance(StudioFolder(root)).get_runs(limit=1)[0]


def content(root):
    """Bytes of all there is of dances, and of what was asked."""
    places = [*(root / "dances").rglob("*"), *(root / "lake" / "request").glob("*"), *(root / "lake").glob("*/beat|*")]
    return {path: path.read_bytes() for path in places if path.is_file()}


def test_a_refused_pin_is_never_told_as_the_reason_for_another_staleness(studio, dance):
    before = content(studio)
    outcome = dance(pins=["2=setp"])
    assert (outcome.status, outcome.facts["conflict"]) == (2, ["2=setp"])
    assert last_run(studio).status == dg.DagsterRunStatus.FAILURE
    assert content(studio) == before
    assert {facts["state"] for facts in studio_status(studio).facts["assets"]} == {"fresh"}
    (studio / "odori.toml").write_text("[path]\nseam_cost = 1.5\n")
    read = ("dance.blend_shape", "dance.lock_feet", "dance.frame_rate_hz", "path", "dance.blend_s")
    changed = f"settings {', '.join(f'[{name}]' for name in read)} changed"
    assert told(studio) == {"beat|graph": ("stale", changed)}
    (studio / "odori.toml").unlink()
    assert {facts["state"] for facts in studio_status(studio).facts["assets"]} == {"fresh"}


def test_a_failure_is_told_while_its_inputs_stay_and_retried_when_they_change(studio, dance, brief, build):
    brief(IMPOSSIBLE)
    assert dance().status == 2
    for asked in ({}, {"pins": ["2=setp"]}):  # what is refused besides takes nothing from it
        if asked:
            assert dance(**asked).status == 2
        state, why = told(studio)["beat|graph"]
        assert state == "failed"
        assert "no such thing" in why
        assert "setp" not in why
    again = build(studio, dances=True)  # tried again by every build, told by each
    assert again.status == 1
    assert [t for t in again.troubles if t.startswith("failed: [beat|graph]") and "no such thing" in t]
    assert build(studio).status == 0  # nobody asked for dances
    brief(POSSIBLE)
    state, why = told(studio)["beat|graph"]
    assert (state, why) == ("stale", "sources changed")
    assert build(studio, dances=True).status == 0
    assert told(studio)["beat|graph"] == ("fresh", "")


def test_songs_and_methods_do_not_mix(studio, dance, brief, remember):
    shutil.copy(studio / "songs" / "beat.wav", studio / "songs" / "echo.wav")
    brief(IMPOSSIBLE, song="echo")
    assert dance("echo").status == 2
    folder = StudioFolder(studio)
    assert set(folder.requests()) == {"beat|graph"}
    folder.remember("echo|graph", Request())
    remember(seed=1)
    states = told(studio)
    assert states["beat|graph"] == ("stale", "sources changed")
    assert states["echo|graph"][0] == "failed"
    # Of a method never danced by, nothing is left when it is refused.
    assert dance("echo", method="matching").status == 2
    assert set(told(studio)) == {"beat|graph", "echo|graph"}
    assert not list((studio / "lake").glob("choreography/echo|*"))


def test_a_dance_that_could_not_begin_was_not_asked_for(studio, dance):
    before = content(studio)
    for asked in ({"pins": ["3-5=step"]}, {"method": "matching"}):
        with building.exclusive(StudioFolder(studio)), pytest.raises(StudioError, match="another odori is building it"):
            dance(**asked)
    assert content(studio) == before
    assert told(studio) == {"beat|graph": ("fresh", "")}


def test_a_run_started_by_hand_is_told_of_what_it_was_started_for(studio, remember):
    remember(pins=("2=setp",))
    made = ("choreography", "dance_pose", "frame_lineage")
    folder = StudioFolder(studio)
    instance = building.open_instance(folder)
    job = build_definitions(folder).resolve_job_def("make_dance")
    done = job.execute_in_process(
        instance=instance,
        partition_key=dg.MultiPartitionKey({"song": "beat", "method": "graph"}),
        asset_selection=[dg.AssetKey(asset) for asset in made],
        raise_on_error=False,
    )
    assert not done.success
    marked = instance.get_run_by_id(done.run_id).tags[building.ASKED_TAG]
    assert marked == freshness(folder).asked_version(made[::-1], "beat|graph")
    assert told(studio)["beat|graph"][0] == "failed"
    remember(pins=("3-5=step",))
    assert told(studio)["beat|graph"] == ("stale", "sources changed")


def test_what_is_asked_of_a_run_does_not_depend_on_what_it_makes(built):
    """A pose made anew in the run changes nothing for it; one from outside does, and so do code and request."""
    folder = StudioFolder(built)
    together, alone = ("choreography", "dance_pose"), ("dance_pose",)
    state, other = freshness(folder), freshness(folder)
    made = dataclasses.replace(state.stamp("choreography", "beat|graph"), content="another")
    other._stamps["choreography", "beat|graph"] = made
    assert other.asked_version(together, "beat|graph") == state.asked_version(together, "beat|graph")
    assert other.asked_version(alone, "beat|graph") != state.asked_version(alone, "beat|graph")
    assert _raised(state, folder).asked_version(together, "beat|graph") != state.asked_version(together, "beat|graph")
    assert _raised(state, folder).asked_version(alone, "beat|graph") == state.asked_version(alone, "beat|graph")


def _raised(state, folder):
    """Give the states with the code of the graph's method changed."""
    node = state.assets["choreography"]
    methods = {**node.methods, "graph": {**node.methods["graph"], "version": "raised"}}
    return Freshness({**state.assets, "choreography": dataclasses.replace(node, methods=methods)}, folder.lake, folder)


def test_sensor_asks_again_for_what_failed_when_its_inputs_change(studio, remember):
    """The same is asked for once, whole; another request again, and another version of the method's code too."""
    folder = StudioFolder(studio)
    instance, definitions = building.open_instance(folder), build_definitions(folder)

    def asked(state):
        found = requests(instance, folder, state, groups=building.GROUPS)
        for request in found:
            definitions.resolve_job_def(request.job_name).execute_in_process(
                instance=instance,
                partition_key=request.partition_key,
                asset_selection=request.asset_selection,
                tags={**request.tags, "dagster/run_key": request.run_key},
                raise_on_error=False,
            )
        return [request.job_name for request in found]

    for pins in (("2=setp",), ("3=setp",)):
        remember(pins=pins)
        assert asked(freshness(folder)) == ["make_dance"]
        assert last_run(studio).status == dg.DagsterRunStatus.FAILURE
        assert asked(freshness(folder)) == []
        assert told(studio)["beat|graph"][0] == "failed"
    assert asked(_raised(freshness(folder), folder)) == ["make_dance"]
