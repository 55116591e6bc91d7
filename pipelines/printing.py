"""What a command prints: its report or its one JSON object on standard output, all else on standard error."""

import io
import json
import sys
from collections.abc import Mapping
from typing import Any

import typer
from rich.console import Console

DONE, SOME_REFUSED, NOTHING_DONE = 0, 1, 2
"""Exit statuses, by convention: 0 is well."""

TROUBLE = Console(stderr=True, highlight=False, soft_wrap=True, markup=False, emoji=False)
_answered: list[bool] = []
"""Whether standard output has had its one object."""


def has_answered() -> bool:
    """Whether the one JSON object was printed."""
    return bool(_answered)


def say(text: str, as_json: bool) -> None:
    """Print for a person: on standard error where a machine reads standard output.

    Parameters
    ----------
    text : the report, or a line of it
    as_json : whether a machine reads standard output
    """
    (TROUBLE if as_json else Console(highlight=False, soft_wrap=True, markup=False, emoji=False)).print(text)


def finish(result: Any, as_json: bool) -> None:  # noqa: ANN401 - an Outcome; typed where it is loaded
    """Print what a command came to, and end with its exit status.

    Parameters
    ----------
    result : pipelines.commands.outcome.Outcome
    as_json : whether a machine reads standard output

    Raises
    ------
    typer.Exit
        Always.
    """
    for line in result.troubles:
        TROUBLE.print(line)
    if as_json:
        answer(result.facts)
    elif result.report:
        say(result.report, as_json)
    raise typer.Exit(result.status)


def answer(facts: Mapping[str, Any]) -> None:
    """Print the one JSON object: in UTF-8, whatever the console or the pipe would have it in.

    Parameters
    ----------
    facts : what JSON can hold
    """
    _answered.append(True)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(encoding="utf-8", errors="backslashreplace", newline="\n")
    sys.stdout.write(json.dumps(facts, ensure_ascii=False, sort_keys=True) + "\n")


def settle_streams() -> None:
    """Let no sign end a report: what the encoding of a console lacks is written as its number."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


class Complaint:
    """Turn what the user can mend into one sentence and exit status 2.

    Parameters
    ----------
    as_json : whether a machine reads standard output
    """

    def __init__(self, as_json: bool) -> None:
        self._as_json = as_json

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: object) -> None:
        if error is None or isinstance(error, typer.Exit):
            return
        from assets.formats.errors import FormatError
        from pipelines.studio.files import LakeError, StudioError

        if isinstance(error, StudioError | LakeError | FormatError | LookupError | OSError):
            text = error.args[0] if isinstance(error, LookupError) and error.args else str(error)
            TROUBLE.print(f"odori: {text}")
            if self._as_json:
                answer({"error": str(text)})
            raise typer.Exit(NOTHING_DONE) from error
