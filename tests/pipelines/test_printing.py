"""What a command prints, on streams of any encoding."""

import io
import json
import sys

import pytest

from pipelines import printing


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "cp932", "utf-16", "utf-8"])
def test_every_encoding_of_a_pipe(encoding, monkeypatch):
    """An answer, a report and a complaint, with signs of three bytes, of four, and none of any encoding."""
    text = "歌 Été 🕺 \udce9"
    streams = {name: io.TextIOWrapper(io.BytesIO(), encoding=encoding) for name in ("stdout", "stderr")}
    for name, stream in streams.items():
        monkeypatch.setattr(sys, name, stream)
    monkeypatch.setattr(printing, "_answered", [])
    printing.settle_streams()
    printing.TROUBLE.print(text)
    printing.say(text, False)
    streams["stdout"].flush()
    said = streams["stdout"].buffer.getvalue()
    printing.answer({"path": text})
    for stream in streams.values():
        stream.flush()
    assert r"\udce9" in streams["stderr"].buffer.getvalue().decode(encoding)
    assert ("歌" in said.decode(encoding)) == (encoding in ("cp932", "utf-16", "utf-8"))
    answer = streams["stdout"].buffer.getvalue()[len(said) :]
    assert json.loads(answer.decode("utf-8")) == {"path": text}
