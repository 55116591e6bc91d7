"""The wheel alone, in an environment and a folder that know no checkout: all files inside, every command at work."""

import json
import os
import shutil
import socket
import subprocess
import sys
import time
import tomllib
import urllib.request
import zipfile
from pathlib import Path

import psutil
import pytest

from assets.formats.file_names import WINDOWS
from assets.formats.usd_read import read_animation
from pipelines.collection import ASSETS
from pipelines.freshness import nodes
from pipelines.processes import GROUP

pytestmark = pytest.mark.slow

REPOSITORY = Path(__file__).parents[1]
PACKAGES = ("odori", "pipelines", "assets", "kernels", "schemas")
PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def uv(*arguments):
    from uv import find_uv_bin

    subprocess.run([find_uv_bin(), *map(str, arguments)], check=True, cwd=REPOSITORY, timeout=900)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Build the wheel as `make wheel` does."""
    folder = tmp_path_factory.mktemp("dist")
    uv("build", "--quiet", "--wheel", "--no-build-isolation", "--python", sys.executable, "--out-dir", folder)
    (found,) = folder.glob("*.whl")
    return found


class Bare:
    """A folder with an environment that holds the wheel and what it needs, and nothing else."""

    def __init__(self, folder):
        self.folder = folder
        self.bin = folder / "environment" / ("Scripts" if WINDOWS else "bin")
        self.environment = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("ODORI", "DAGSTER", "PYTHON", "VIRTUAL_ENV", "PYTEST"))
        } | {"PATH": os.pathsep.join([str(self.bin), os.defpath])}

    def run(self, *command):
        """Run a command of the environment in the folder."""
        return subprocess.run(
            [self.bin / command[0], *command[1:]],
            capture_output=True,
            encoding="utf-8",
            cwd=self.folder,
            env=self.environment,
            check=False,
            timeout=900,
        )


@pytest.fixture(scope="module")
def bare(wheel, tmp_path_factory):
    """Install the wheel, with what it runs on at the versions that are locked."""
    found = Bare(tmp_path_factory.mktemp("elsewhere"))
    uv("venv", "--quiet", "--python", sys.executable, found.bin.parent)
    lock = ("--constraint", REPOSITORY / "requirements.lock")
    uv("pip", "install", "--quiet", "--python", found.bin.parent, *lock, wheel)
    return found


def test_every_tracked_file_of_the_packages_is_inside(wheel):
    tracked = subprocess.run(
        ["git", "ls-files", "-z", *PACKAGES], capture_output=True, cwd=REPOSITORY, check=True
    ).stdout.decode()
    names = set(tracked.split("\0")) - {""}
    with zipfile.ZipFile(wheel) as package:
        inside = {name for name in package.namelist() if ".dist-info/" not in name}
        different = [name for name in sorted(names & inside) if package.read(name) != (REPOSITORY / name).read_bytes()]
    assert inside == names
    assert different == []
    assert {"kernels/opencl/match_score.cl", "kernels/music/pulse_weights.py"} <= inside


def test_the_wheel_says_what_it_is(wheel):
    assert wheel.name == f"odori-{PROJECT['version']}-py3-none-any.whl"
    with zipfile.ZipFile(wheel) as package:
        told = package.read(f"odori-{PROJECT['version']}.dist-info/METADATA").decode()
    assert f"\nVersion: {PROJECT['version']}\n" in told
    low, high = PROJECT["requires-python"].split(",")
    assert f"\nRequires-Python: {high},{low}\n" in told or f"\nRequires-Python: {low},{high}\n" in told


def test_no_checkout_and_no_tool_of_ours_is_near(bare):
    code = "import pipelines, importlib.util as u; print(pipelines.__file__, u.find_spec('pytest'))"
    said = bare.run("python", "-c", code).stdout.split()
    assert Path(said[0]).is_relative_to(bare.bin.parent)
    assert said[1] == "None"
    assert bare.run("odori", "--version").stdout.strip() == f"odori {PROJECT['version']}"


@pytest.fixture(scope="module")
def demo(bare):
    """Run `odori demo`; its answer."""
    done = bare.run("odori", "demo", "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_demo_makes_a_dance(bare, demo):
    stage = bare.folder / demo["stage"]
    assert read_animation(stage).n_frames > 900
    assert (bare.folder / demo["usdz"]).is_file()
    assert demo["quality"]["beat_p_probability"] < 0.01
    done = bare.run("odori", "check", demo["usdz"], "--json")
    assert json.loads(done.stdout)["is_valid"], done.stdout


def test_a_song_is_danced_again_without_work(bare, demo):
    before = (bare.folder / demo["stage"]).read_bytes()
    done = bare.run("odori", "dance", "drum_machine", "--studio", "demo", "--method", "graph", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["clips"] == demo["clips"]
    assert (bare.folder / demo["stage"]).read_bytes() == before


def answered(address, data=None):
    """Ask the server; what it says, or None while it is not up."""
    request = urllib.request.Request(address, data, {"Content-Type": "application/json"} if data else {})
    try:
        with urllib.request.urlopen(request, timeout=10) as said:
            return said.status, said.read().decode()
    except OSError:
        return None


def test_the_page_shows_the_assets_and_leaves_no_process(bare, demo):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    errors = (bare.folder / "ui.txt").open("wb")
    server = subprocess.Popen(
        [shutil.which("odori", path=str(bare.bin)), "ui", "--studio", "demo", "--port", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=errors,
        cwd=bare.folder,
        env=bare.environment,
        creationflags=GROUP,
    )
    process, family = psutil.Process(server.pid), []
    try:
        address, deadline = f"http://127.0.0.1:{port}", time.monotonic() + 180
        while (page := answered(f"{address}/assets")) is None:
            assert server.poll() is None, (bare.folder / "ui.txt").read_text(encoding="utf-8", errors="replace")
            assert time.monotonic() < deadline, "the page never came"
            time.sleep(0.5)
        assert page[0] == 200
        assert "<html" in page[1]
        query = json.dumps({"query": "{ assetNodes { assetKey { path } } }"}).encode()
        status, text = answered(f"{address}/graphql", query)
        assert status == 200
        listed = {"/".join(node["assetKey"]["path"]) for node in json.loads(text)["data"]["assetNodes"]}
        assert listed == set(nodes(ASSETS))
        family = process.children(recursive=True)
        assert len(family) >= 2
    finally:
        if WINDOWS:
            import signal

            server.send_signal(signal.CTRL_BREAK_EVENT)
        else:
            server.terminate()
        status = server.wait(60)
        errors.close()
    assert status == 0
    assert [p for p in family if p.is_running() and p.status() != psutil.STATUS_ZOMBIE] == []
