from kernels.matching import score, search
from kernels.opencl import match


def test_the_face_of_the_search_is_its_parts():
    assert search.Match is score.Match
    assert search.Matcher is match.Matcher
    assert search.merge_matches is score.merge_matches
    assert all(hasattr(search, name) for name in search.__all__)
