"""A small studio of the made-up dancer, built once; tests that change it work on a copy."""

import shutil
from pathlib import Path

import pytest

from assets.formats import audio, bvh
from assets.formats.audio import Audio
from kernels.synthetic.dancer import take
from kernels.synthetic.drum_machine import drum_machine_song
from pipelines.commands.build_studio import build_studio
from pipelines.commands.dance_songs import dance_songs
from pipelines.resources import NoProgress

TAKES = {"ayame": ("step", "twist", "wave"), "kaede": ("rock", "kick")}


@pytest.fixture(autouse=True)
def own_instance(monkeypatch):
    """Each studio keeps its own Dagster storage; the machine's is left alone."""
    monkeypatch.delenv("DAGSTER_HOME", raising=False)
    monkeypatch.delenv("ODORI_STUDIO", raising=False)


def write_studio(root: Path) -> Path:
    """Write five clips in two folders and a song of twelve seconds."""
    for folder, labels in TAKES.items():
        (root / "clips" / folder).mkdir(parents=True)
        rows = ["file,label,style,subject,licence"]
        for number, label in enumerate(labels):
            made = take(label, n_beats=10, interval_s=0.5 + 0.02 * number)
            (root / "clips" / folder / f"{label}.bvh").write_bytes(bvh.format(made.clip))
            rows.append(f"{label}.bvh,{label},made up,{folder},CC0-1.0")
        (root / "clips" / folder / "clips.csv").write_text("\n".join(rows))
    (root / "songs").mkdir()
    song = drum_machine_song(tempo_bpm=120, n_bars=6)
    (root / "songs" / "beat.wav").write_bytes(audio.format_wav(Audio(song.render(sample_rate_hz=22050), 22050)))
    return root


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """The small studio, built and danced; not to be changed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("DAGSTER_HOME", raising=False)
        root = write_studio(tmp_path_factory.mktemp("built") / "studio")
        assert build_studio(root, dances=False, progress=NoProgress).status == 0
        outcome = dance_songs(root, ["beat"], method="graph", frame_rate_hz=None, out=None, progress=NoProgress)
        assert outcome.status == 0, outcome.troubles
        yield root


@pytest.fixture(scope="session")
def matched(built, tmp_path_factory):
    """The small studio, its song danced by matching as well; not to be changed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("DAGSTER_HOME", raising=False)
        root = Path(shutil.copytree(built, tmp_path_factory.mktemp("matched") / "studio"))
        outcome = dance_songs(root, ["beat"], method="matching", frame_rate_hz=None, out=None, progress=NoProgress)
        assert outcome.status == 0, outcome.troubles
        return root


@pytest.fixture
def studio(built, tmp_path):
    """A copy of the built studio to work on."""
    return Path(shutil.copytree(built, tmp_path / "studio"))


@pytest.fixture
def fresh_studio(tmp_path):
    """The small studio before anything was built."""
    return write_studio(tmp_path / "studio")


@pytest.fixture
def build():
    """Run ``odori build`` in this process."""

    def run(root, *, dances=False):
        return build_studio(root, dances=dances, progress=NoProgress)

    return run
