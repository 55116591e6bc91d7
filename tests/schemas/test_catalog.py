"""All declared tables together: what outside readers rely on, and one declaration a column."""

import pyarrow as pa
import pytest

from schemas.catalog import TABLES

# What the outside relies on; columns may be added freely.
PROMISED = {
    "clip": "clip_id session path source_sha256 frame_rate_hz frame_count duration_s label style subject licence "
    "state reason",
    "canonical_pose": "clip_id frame_index time_s root_xyz_m rotation_wxyz position_xyz_m",
    "motion_beat": "clip_id beat_index time_s frame_index confidence",
    "motion_tempo": "clip_id tempo_bpm confidence_probability has_pulse",
    "music_beat": "song_id beat_index time_s bar_number beat_in_bar_number confidence",
    "motion_feature": "clip_id time_s rhythm intensity",
    "music_feature": "song_id time_s rhythm intensity",
    "music_segment": "song_id segment_index start_s end_s start_frame_index frame_count",
    "match": "song_id segment_index rank_number clip_id scale_ratio start_frame_index score",
    "percussion": "song_id time_s key_number velocity",
    "key_pose": "clip_id start_s peak_s end_s state_index",
    "choreography_model": "parameter_name state_index target_index probability",
    "choreography": "step_index song_start_s song_end_s clip_id clip_start_s clip_end_s has_seam blend_s warp_ratio "
    "pin_id",
    "frame_lineage": "frame_index time_s clip_id clip_time_s blend_clip_id blend_time_s blend_weight_ratio warp_ratio",
    "dance_quality": "metric_name value wanted is_passed reasons",
}


@pytest.mark.parametrize("name", PROMISED)
def test_promised_columns_are_there(name):
    assert set(PROMISED[name].split()) <= set(TABLES[name].arrow.names)


@pytest.mark.parametrize("name", TABLES)
def test_every_table_tells_whose_it_is(name):
    if name != "motion_encoder":  # it is of the whole catalogue
        assert {"clip_id", "song_id"} & set(TABLES[name].arrow.names)
    assert TABLES[name].name == name
    assert set(TABLES[name].key) <= set(TABLES[name].arrow.names)


@pytest.mark.parametrize("name", TABLES)
def test_every_column_has_a_meaning_of_one_sentence(name):
    for column in TABLES[name].columns:
        assert column.meaning.endswith("."), column.name
        assert column.meaning[0].isupper(), column.name


def test_a_column_of_two_tables_has_one_type():
    kinds = {}
    for table in TABLES.values():
        for column in table.columns:
            kinds.setdefault(column.name, {})[table.name] = column.type
    assert {name: types for name, types in kinds.items() if len(set(types.values())) > 1} == {}


def test_frame_tables_hold_lists_of_fixed_size_lists():
    field = TABLES["canonical_pose"].arrow.field("rotation_wxyz")
    assert field.type == pa.list_(pa.list_(pa.float32(), 4))
