import pytest

import odori
from assets.dancing.refusal import RefusalError
from assets.formats.errors import FormatError
from odori.exceptions import refused
from pipelines.studio.files import LakeError, StudioError


@pytest.mark.parametrize(
    "error",
    [
        StudioError("s: not there"),
        LakeError("s: not there"),
        FormatError("s", 0, "not there"),
        OSError("s: not there"),
        KeyError("s: not there"),
    ],
)
def test_what_the_engine_refuses_is_one_kind_of_error(error):
    with pytest.raises(odori.OdoriError) as caught, refused():
        raise error
    assert caught.value.reason == str(caught.value) == "s: not there"
    assert caught.value.conflict == caught.value.ways_out == []
    assert caught.value.__cause__ is error


def test_a_refused_dance_keeps_its_conflict_and_its_ways_out():
    with pytest.raises(odori.DanceRefusedError) as caught, refused():
        raise RefusalError("no", conflict=["12=spin"], ways_out=["13=spin"])
    assert (caught.value.conflict, caught.value.ways_out) == (["12=spin"], ["13=spin"])


def test_values_that_cannot_be_meant_are_value_errors_too():
    with pytest.raises(ValueError, match="want > 0") as caught, refused():
        raise ValueError("rate: want > 0, got 0")
    assert isinstance(caught.value, odori.InputError)


def test_faults_of_the_program_stay_what_they_are():
    with pytest.raises(ZeroDivisionError), refused():
        raise ZeroDivisionError
