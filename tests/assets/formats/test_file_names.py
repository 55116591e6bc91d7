"""Names of files on Windows: legal there, and back to the key."""

import re

import pytest

from assets.formats.file_names import WINDOWS, file_name, key_of, name_anew
from assets.partitions import METHOD
from schemas.catalog import TABLES
from schemas.keys import LONGEST_KEY, is_key, session_key, song_key

KEYS = ("waltz", "waltz|graph", "a_b-c|graph_2", "con", "con|hmm", "nul", "com1", "com10", "lpt9", "aux_1", "console")
FORBIDDEN = re.compile(r'[<>:"/\\|?*\x00-\x1f]|[. ]$')
# As Windows has it: whatever comes after the first dot.
DEVICE = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])", re.IGNORECASE)


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("windows", [True, False])
def test_every_name_leads_back_to_its_key(key, windows):
    assert key_of(file_name(key, windows=windows), windows=windows) == key


def test_names_of_windows_are_legal_there_and_apart_whatever_the_letters():
    names = [file_name(key, windows=True) for key in KEYS]
    assert not [name for name in names if FORBIDDEN.search(name) or DEVICE.fullmatch(name.split(".")[0])]
    assert len({name.lower() for name in names}) == len(KEYS)
    assert file_name("waltz|graph", windows=True) == "waltz%7Cgraph"
    assert file_name("con", windows=True) == "con_"
    assert file_name("com10", windows=True) == "com10"


def test_elsewhere_the_public_name_stays():
    assert [file_name(key, windows=False) for key in KEYS] == list(KEYS)
    assert file_name("waltz|graph") == ("waltz%7Cgraph" if WINDOWS else "waltz|graph")


@pytest.mark.parametrize("stem", ["CON", "Nul ", "aux.", "com1-", "PRN!"])
def test_sources_can_be_named_so_that_their_key_is_a_device(stem):
    """Windows itself has no file ``con.wav``, but ``con!.wav`` is one, and other systems have both."""
    for key in (song_key(stem), session_key([stem])):
        assert is_key(key)
        assert DEVICE.fullmatch(key)
        assert not DEVICE.fullmatch(file_name(key, windows=True))


def test_a_lake_that_comes_from_windows_gets_the_names_of_here(tmp_path):
    for name in ("waltz%7Cgraph.parquet", "con_.parquet", "waltz.parquet", "waltz%7Chmm.json"):
        (tmp_path / name).write_bytes(name.encode())
    assert name_anew(tmp_path, ".parquet", windows=True) == 0
    assert name_anew(tmp_path, ".parquet", windows=False) == 2
    assert {p.name for p in tmp_path.iterdir()} == {
        "waltz|graph.parquet",
        "con.parquet",
        "waltz.parquet",
        "waltz%7Chmm.json",
    }
    assert (tmp_path / "waltz|graph.parquet").read_bytes() == b"waltz%7Cgraph.parquet"
    assert name_anew(tmp_path / "nowhere", ".parquet", windows=False) == 0


def test_what_has_its_name_here_already_is_not_written_over(tmp_path):
    (tmp_path / "a|graph.parquet").write_bytes(b"here")
    (tmp_path / "a%7Cgraph.parquet").write_bytes(b"there")
    assert name_anew(tmp_path, ".parquet", windows=False) == 0
    assert (tmp_path / "a|graph.parquet").read_bytes() == b"here"


def test_paths_leave_room_for_the_folder_of_the_studio():
    """Windows ends a path at 260 signs unless told otherwise: 100 of them are the studio's."""
    song = "s" * LONGEST_KEY
    keys = [f"{song}|{method}" for method in METHOD.get_partition_keys()]
    stored = [f"lake/{table}/{file_name(key, windows=True)}.parquet" for table in TABLES for key in (*keys, song)]
    beside = [f"dances/{song}/.tmp-{'0' * 32}.usdc", *(f"dances/{song}/{key.split('|')[1]}.usdz" for key in keys)]
    assert max(map(len, (*stored, *beside))) < 160
