import pytest

import odori
from pipelines.commands.why import explain_dance


def test_a_finished_dance_knows_its_files_measures_steps_and_poses(shown):
    dance = shown.dances["drum_machine|graph"]
    assert dance.stage.is_file()
    assert dance.usdz.is_file()
    assert dance.is_as_wanted == (dance.not_as_wanted == [])
    assert set(dance.missed) <= set(dance.quality)
    assert set(dance.quality) > {"beat_f_ratio", "beat_p_probability"}
    assert dance.steps.height == shown.table("choreography").num_rows
    assert dance.frames.height == dance.poses.n_frames
    assert dance.licence["name"] == "CC0-1.0"
    assert dance.pins == []
    assert repr(dance) == f"<dance drum_machine|graph: {dance.usdz}>"


def test_a_moment_comes_from_where_the_command_says(shown):
    facts = explain_dance(shown.root, "drum_machine", at_s=12.0).facts
    dance = shown.dances["drum_machine|graph"]
    for origin in (dance.why(12), shown.why("drum_machine", 12.0), shown.why(dance, 12.0), shown.why(dance.usdz, 12.0)):
        assert (origin.clip_id, origin.clip_time_s, origin.path) == (
            facts["clip_id"],
            facts["clip_time_s"],
            facts["path"],
        )
        assert origin.costs == facts["step"]["costs"]
        assert origin.pin is None
    assert dance.frames["clip_id"][origin.facts["frame_index"]] == origin.clip_id


@pytest.mark.parametrize(("dance", "at_s", "words"), [("drum_machine", 1e6, "within"), ("waltz", 1.0, "waltz")])
def test_moments_and_dances_that_are_none_are_refused(shown, dance, at_s, words):
    with pytest.raises(odori.OdoriError, match=words):
        shown.why(dance, at_s)
