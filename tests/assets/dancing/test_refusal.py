import dagster as dg
import pytest

from assets.dancing.chosen_steps import Markdown
from assets.dancing.refusal import RefusalError
from assets.declare import refusals_fail, shown


def test_a_refusal_is_its_sentence_and_tells_a_machine_what_it_knows():
    refused = RefusalError("12=spin: cannot be kept", conflict=["12=spin"], why="cannot be kept", ways_out=[])
    assert str(refused) == refused.sentence == "12=spin: cannot be kept"
    assert refused.facts == {"conflict": ["12=spin"], "why": "cannot be kept", "ways_out": []}
    assert RefusalError("no clip can be danced").facts == {}


def test_in_a_run_it_becomes_a_failure_that_is_not_tried_again():
    with pytest.raises(dg.Failure) as failed, refusals_fail():
        raise RefusalError("no", conflict=["a", "b"], why="why", ways_out=[{"pin": "c"}])
    assert failed.value.description == "no"
    assert failed.value.allow_retries is False
    assert failed.value.metadata["conflict"].data == ["a", "b"]
    assert failed.value.metadata["ways_out"].data == [{"pin": "c"}]
    assert failed.value.metadata["why"].value == "why"


def test_other_errors_pass_through():
    with pytest.raises(ValueError, match="k: want"), refusals_fail():
        raise ValueError("k: want >= 1, got 0")


def test_plain_values_are_made_ready_for_pages():
    ready = shown({"cost": 1.5, "text": "a", "table": Markdown("| a |"), "pins": [1, 2], "costs": {"warp": 1.0}})
    assert ready["cost"] == 1.5
    assert ready["text"] == "a"
    assert isinstance(ready["table"], dg.MarkdownMetadataValue)
    assert isinstance(ready["pins"], dg.JsonMetadataValue)
    assert isinstance(ready["costs"], dg.JsonMetadataValue)
