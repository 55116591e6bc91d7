"""Tables for people are written as they should be."""

from assets.plots.draw import markdown


def test_long_tables_are_cut_with_a_word():
    table = markdown(("a",), [(i,) for i in range(100)], longest=10)
    assert table.count("\n| ") == 9 + 1
    assert "and 90 more" in table
