"""Reading sessions within the studio's limits."""

from types import SimpleNamespace

import pytest

from assets.capture import _Reader
from assets.formats import bvh
from assets.formats.clips_csv import Facts
from assets.sources.sources import ClipFile
from kernels.synthetic.dancer import take
from pipelines.resources import NoProgress
from schemas.settings import Limits, Settings


@pytest.mark.parametrize("largest_clip_mb", [0.01, 10.0, 4000.0])
def test_the_largest_clip_is_the_settings_not_the_readers(tmp_path, monkeypatch, largest_clip_mb):
    """What the folder's scan lets in is read, however large: the reader has no limit of its own."""
    (tmp_path / "step.bvh").write_bytes(bvh.format(take("step", n_beats=4).clip))
    asked = []
    read = bvh.read
    monkeypatch.setattr(bvh, "read", lambda path, **limits: asked.append(limits) or read(path, **limits))
    settings = Settings(limits=Limits(largest_clip_mb=largest_clip_mb))
    studio = SimpleNamespace(settings=lambda: settings, file=lambda path: tmp_path / path)
    reader = _Reader(
        studio, SimpleNamespace(), SimpleNamespace(stamp=lambda *_: None, table=lambda *_: None), NoProgress(), "1"
    )
    parts = reader.read("s", (ClipFile("s-step", "s", "step.bvh", "0", Facts()),))
    assert asked == [{"max_bytes": round(largest_clip_mb * 1e6)}]
    (row,) = parts["clip"].table.to_pylist()
    assert row["state"] == ("refused" if largest_clip_mb < 0.1 else "read")
