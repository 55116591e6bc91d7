"""The whole pipeline as a user runs it: cold build, unchanged build, one clip changed, one song danced.

Each figure is one run of the command in a process of its own, wall seconds and CPU seconds of it and its children, on a
new studio of the folders ``bvh_dance`` and ``bvh_labelled`` of real test data, or of the made-up dancer where there are
none, with one song.
"""

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]
DATA = Path(os.environ.get("ODORI_TEST_DATA", REPOSITORY.parent / "shared" / "data"))


def odori(*arguments: object) -> tuple[float, float]:
    """Run the command; wall seconds, CPU seconds."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "pipelines.cli", *map(str, arguments)], capture_output=True, text=True, check=False
    )
    wall_s = time.perf_counter() - start
    if done.returncode not in (0, 1):
        raise SystemExit(done.stderr)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall_s, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def make_studio(root: Path, song: Path | None) -> int:
    """Write the studio; how many clips it has."""
    if (DATA / "README.md").is_file():
        for name in ("bvh_dance", "bvh_labelled"):
            shutil.copytree(DATA / name, root / "clips" / name, ignore=shutil.ignore_patterns("*.zip"))
        (root / "songs").mkdir()
        chosen = song or DATA / "audio_beats" / "fof_muldjord_chaos_god.ogg"
        shutil.copy(chosen, root / "songs" / f"song{chosen.suffix}")
    else:
        from pipelines.commands import demo_studio

        demo_studio.make(root)
        (root / "songs" / "drum_machine.mid").unlink()
        (root / "songs" / "drum_machine.wav").rename(root / "songs" / "song.wav")
    for place in (root, *root.rglob("*")):
        place.chmod(place.stat().st_mode | 0o200)
    return len(list((root / "clips").rglob("*.bvh")))


def measure(song: Path | None) -> dict[str, float]:
    """Run the four cases."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "studio"
        found: dict[str, float] = {"clips": make_studio(root, song)}
        cases = {
            "cold_build": ("build",),
            "unchanged_build": ("build",),
            "changed_clip_build": ("build",),
            "dance": ("dance", "song"),
            "unchanged_dance": ("dance", "song"),
        }
        for name, arguments in cases.items():
            if name == "changed_clip_build":
                clips = sorted((root / "clips").rglob("*.bvh"))
                clips[0].write_bytes(clips[1].read_bytes())
            found[f"{name}_wall_s"], found[f"{name}_cpu_s"] = odori(*arguments, "--studio", root)
        return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--song", type=Path, help="a song of your own")
    options = parser.parse_args()
    found = measure(options.song)
    if options.json:
        print(json.dumps({k: round(v, 3) for k, v in found.items()}))
        return
    print(f"{found['clips']:.0f} clips, one song, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    for name in [k.removesuffix("_wall_s") for k in found if k.endswith("_wall_s")]:
        print(f"{name:20} {found[name + '_wall_s']:7.2f} s wall {found[name + '_cpu_s']:7.2f} s CPU")


if __name__ == "__main__":
    main()
