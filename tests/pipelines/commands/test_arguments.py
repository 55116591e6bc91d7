import pytest

from pipelines.collection import freshness
from pipelines.commands.arguments import briefed_method, wanted_songs
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder


@pytest.fixture
def folder(built):
    return StudioFolder(built)


@pytest.mark.parametrize("text", ["beat", "beat.wav", "songs/beat.wav", "elsewhere/beat.wav", "all"])
def test_a_song_is_found_by_key_name_or_path(folder, text):
    assert [song.key for song in wanted_songs(folder.sources(), [text], folder)] == ["beat"]


def test_a_song_that_is_not_there_is_an_error_that_names_the_nearest(folder):
    with pytest.raises(StudioError, match=r"beet: want a song of this studio, .* near are beat"):
        wanted_songs(folder.sources(), ["beet"], folder)


def test_the_brief_names_the_method_else_it_is_the_usual_one(fresh_studio):
    folder = StudioFolder(fresh_studio)
    song = freshness(folder).sources.song("beat")
    assert briefed_method(folder, song) == "graph"
    brief = fresh_studio / "songs" / "beat.brief.toml"
    for text, method in (('method = "matching"\n', "matching"), ("method = \n", "graph")):
        brief.write_text(text, encoding="utf-8")
        assert briefed_method(folder, freshness(folder).sources.song("beat")) == method
