"""The house's own rules, kept by machine."""

import ast
import importlib.util
import re
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
PACKAGES = ("odori", "pipelines", "assets", "kernels", "schemas")
SOURCES = sorted(p for package in PACKAGES for p in (REPOSITORY / package).rglob("*.py"))
TEXTS = sorted(
    p
    for p in REPOSITORY.rglob("*")
    if p.is_file()
    and p.suffix in {".py", ".md", ".toml", ".lock", ".cl", ".txt", ".yaml", ""}
    and not any(
        part.startswith(".venv") or part in {".git", "demo", "studio"} for part in p.relative_to(REPOSITORY).parts
    )
    and "cache" not in str(p)
)


@pytest.mark.parametrize(
    "path", [p for p in SOURCES if p.name != "pulse_weights.py"], ids=lambda p: str(p.relative_to(REPOSITORY))
)
def test_no_file_grows_past_500_lines(path):
    assert len(path.read_text().splitlines()) <= 500


def test_no_folder_or_file_is_named_for_nothing():
    empty_words = {"util", "utils", "common", "helper", "helpers", "misc", "base"}
    assert not [p for p in SOURCES if empty_words & {p.stem, *p.relative_to(REPOSITORY).parts[:-1]}]


def test_package_files_hold_one_docstring_and_no_imports():
    for path in SOURCES:
        if path.name == "__init__.py" and path.parent.name != "odori":  # the front door, which gives names
            assert re.fullmatch(r'"""[^"]+"""\n', path.read_text()), path


def test_no_public_class_name_means_two_things():
    """A reader knows from the name of a class alone which one is meant."""
    found = [
        (node.name, path)
        for path in SOURCES
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    ]
    homes = {name: [p.relative_to(REPOSITORY).as_posix() for n, p in found if n == name] for name, _ in found}
    assert {name: paths for name, paths in homes.items() if len(paths) > 1} == {}


AREA_FOLDERS = {"schemas", "assets", "assets/tables", "assets/plots", "assets/reading", "assets/sources"}


def test_no_module_name_means_two_things():
    """A module's name stands once in the house; only an area's comes again, where that is made, packed or drawn.

    An area is a file of `schemas` or of `assets` itself: `music` is its tables, its assets, its rows and its pictures.
    A plural is the same name, unless both stand in one folder: `method` is the record, `methods` are those there are.
    """
    homes = {}
    for path in SOURCES:
        if path.name != "__init__.py":
            homes.setdefault(path.stem.removesuffix("s"), set()).add(path.relative_to(REPOSITORY))
    doubled = {}
    for name, paths in homes.items():
        folders, stems = {p.parent.as_posix() for p in paths}, {p.stem for p in paths}
        is_area = len(stems) == 1 and folders <= AREA_FOLDERS and folders & {"schemas", "assets"}
        is_record_and_list = len(folders) == 1
        if len(paths) > 1 and not is_area and not is_record_and_list:
            doubled[name] = sorted(map(str, paths))
    assert doubled == {}


# Declarations, plain records and the thinnest glue are tested where they are used.
TESTED_ELSEWHERE = {
    "assets/dancing/method.py",  # records
    "pipelines/commands/build_studio.py",  # in test_commands.py and test_build.py
    "pipelines/commands/check.py",
    "pipelines/commands/dance_songs.py",
    "pipelines/commands/session.py",
    "pipelines/studio/folder.py",
    "assets/dancing/chosen_steps.py",  # a record
    "schemas/options.py",  # in test_settings.py
    "assets/choreography.py",
    "assets/dance.py",
    "assets/declare.py",
    "assets/graph.py",
    "assets/hmm.py",
    "assets/motion.py",
    "assets/search.py",
    "assets/partitions.py",
    "assets/formats/errors.py",
    "kernels/music/pulse_weights.py",
    "kernels/synthetic/grooves.py",
    "pipelines/collection.py",
    "pipelines/commands/hmm_report.py",
    "pipelines/io_managers.py",
    "pipelines/jobs.py",
    "pipelines/commands/outcome.py",
    "pipelines/commands/progress.py",
    "pipelines/resources.py",
    "pipelines/schedules.py",
    "pipelines/commands/searchable.py",
    "schemas/calibration.py",
    "schemas/choreography.py",
    "schemas/fields.py",
    "schemas/graph.py",
    "schemas/hmm.py",
    "schemas/matching.py",
    "schemas/motion.py",
    "schemas/music.py",
    "schemas/search.py",
    "schemas/stage_contract.py",
}


def test_what_is_tested_elsewhere_is_there_and_has_no_test_of_its_own():
    """The list only shrinks."""
    there = {p.relative_to(REPOSITORY).as_posix() for p in SOURCES}
    tests = {p.relative_to(REPOSITORY / "tests").as_posix() for p in (REPOSITORY / "tests").rglob("test_*.py")}
    assert TESTED_ELSEWHERE - there == set()
    assert {m for m in TESTED_ELSEWHERE if f"{m.rpartition('/')[0]}/test_{m.rpartition('/')[2]}" in tests} == set()


def test_every_module_has_its_test():
    missing = []
    for path in SOURCES:
        relative = path.relative_to(REPOSITORY)
        test = REPOSITORY / "tests" / relative.parent / f"test_{relative.name}"
        if path.name != "__init__.py" and str(relative) not in TESTED_ELSEWHERE and not test.exists():
            missing.append(str(relative))
    assert missing == []


def test_generated_pages_are_up_to_date():
    spec = importlib.util.spec_from_file_location("generate", REPOSITORY / "docs" / "generate.py")
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    for name, text in (("data.md", generate.data()), ("settings.md", generate.settings())):
        assert (REPOSITORY / "docs" / name).read_text() == text, f"docs/{name} lags behind; run 'make docs'"


def test_picture_of_the_asset_graph_is_up_to_date():
    spec = importlib.util.spec_from_file_location("draw_graph", REPOSITORY / "docs" / "draw_graph.py")
    draw_graph = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(draw_graph)
    assert (REPOSITORY / "docs" / "asset-graph.svg").read_text() == draw_graph.picture(), "run 'make docs'"


def test_no_index_host_and_no_path_of_a_machine():
    # Put together from halves, so that this file does not find itself.
    hosts = "|".join(["py" + "pi.org", "python" + "hosted", "npm" + "js", "deb." + "debian"])
    wrong = re.compile(rf"(https?://[a-z.]*({hosts}))|(/ro{'ot'}/)|(/wo{'rk'}/)")
    found = [str(p.relative_to(REPOSITORY)) for p in TEXTS if wrong.search(p.read_text(errors="replace"))]
    assert found == []


# Every public function tells its arguments and its errors. Where the one argument is a name or a path (`str`, `Path`),
# its summary does: there is no shape, unit or range to say. What is named here is left to do; the list only shrinks.
UNDOCUMENTED = {
    f"{folder}/{name}.py"
    for folder, names in {
        "kernels/graph": "alternatives distance beat_features nodes path pin_conflicts program",
        "kernels/hmm": "identity durations evidence instances model states viterbi",
        "kernels/search": "augment discriminant document encoder encoder_fit measure network train",
        "kernels/motion": "key_poses",
        "kernels/skeleton": "contacts",
        "kernels/music": "drums_and_melody",
        "kernels/synthetic": "hidden_rules",
        "schemas": "pins",
        "assets/formats": "usd_character",
        "assets": "dance graph_memory stage",
        "assets/dancing": "by_graph by_hmm characters proposals wishes",
        "assets/plots": "hmm search",
        "assets/tables": "choreography graph hmm motion music pack search",
        "pipelines": "build cli collection freshness io_managers jobs resources schedules sensors web",
        "pipelines/studio": "files folder lake",
        "pipelines/commands": "arguments build_studio calibrate_recording check dance_songs dance_report "
        "hmm_report progress propose session "
        "status why",
    }.items()
    for name in names.split()
}
DOCUMENTED = [p for p in SOURCES if str(p.relative_to(REPOSITORY)) not in UNDOCUMENTED]


def _is_asset(node):
    return any("table_asset" in ast.unparse(decorator) for decorator in node.decorator_list)


@pytest.mark.parametrize("path", sorted(DOCUMENTED), ids=lambda p: str(p.relative_to(REPOSITORY)))
def test_public_functions_tell_their_arguments_and_errors(path):
    missing = []
    body = ast.parse(path.read_text()).body
    body += [n for c in body if isinstance(c, ast.ClassDef) and not c.name.startswith("_") for n in c.body]
    for node in body:
        if not isinstance(node, ast.FunctionDef) or node.name.startswith("_") or _is_asset(node):
            continue  # of an asset Dagster shows the summary, and its arguments are the tables it is made from
        text = ast.get_docstring(node) or ""
        named = [a for a in (*node.args.args, *node.args.kwonlyargs) if a.arg not in ("self", "cls")]
        is_plain = len(named) == 1 and re.fullmatch(r"(str|Path)( \| (str|Path))?", ast.unparse(named[0].annotation))
        has_sections = "Parameters\n---" in text or "arguments and errors are theirs" in text
        if named and not is_plain and not has_sections:
            missing.append(f"{node.name}: Parameters")
        if any(isinstance(n, ast.Raise) for n in ast.walk(node)) and "Raises\n---" not in text:
            missing.append(f"{node.name}: Raises")
    assert missing == []


def _documented(text):
    """Names in the Parameters section of a docstring."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?=\n\n[A-Z][A-Za-z ]+\n-{3,}|\Z)", text, re.DOTALL | re.MULTILINE)
    lines = section[1].splitlines() if section else []
    return {name.strip(" *") for line in lines if line[:1].strip() for name in line.split(" : ")[0].split(",")}


def _arguments(node):
    """Names of what a function, a record or a class takes."""
    if isinstance(node, ast.ClassDef):
        made = [n for n in node.body if isinstance(n, ast.FunctionDef) and n.name == "__init__"]
        if not made:
            return {n.target.id for n in node.body if isinstance(n, ast.AnnAssign)}
        node = made[0]
    extra = [a for a in (node.args.vararg, node.args.kwarg) if a]
    named = {a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, *extra)}
    return named - {"self", "cls"}


@pytest.mark.parametrize("path", sorted(DOCUMENTED), ids=lambda p: str(p.relative_to(REPOSITORY)))
def test_documented_parameters_are_those_there_are(path):
    body = ast.parse(path.read_text()).body
    body += [n for c in body if isinstance(c, ast.ClassDef) for n in c.body]
    wrong = {
        node.name: sorted(_documented(text) ^ _arguments(node))
        for node in body
        if isinstance(node, ast.FunctionDef | ast.ClassDef)
        and _documented(text := ast.get_docstring(node) or "")
        and _documented(text) != _arguments(node)
    }
    assert wrong == {}


def _is_text(call):
    """Whether a call opens, reads or writes a file as text."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    if name in ("read_text", "write_text"):
        return True
    modes = [a.value for a in call.args if isinstance(a, ast.Constant) and isinstance(a.value, str)]
    modes += [k.value.value for k in call.keywords if k.arg == "mode" and isinstance(k.value, ast.Constant)]
    return name == "open" and not any("b" in mode for mode in modes)


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(REPOSITORY)))
def test_text_files_are_utf8_on_every_system(path):
    """What an encoding is left out for is written in that of the system: cp1252 on Windows."""
    calls = [
        n for n in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(n, ast.Call) and _is_text(n)
    ]
    unsaid = [
        ast.unparse(call)
        for call in calls
        if not any(k.arg == "encoding" for k in call.keywords)
        and not any(isinstance(a, ast.Constant) and str(a.value).startswith("utf-8") for a in call.args)
    ]
    assert unsaid == []


POSIX_ALONE = {"fcntl", "grp", "posix", "pwd", "resource", "termios", "tty"}
POSIX_CALLS = {"os.kill", "os.killpg", "os.getuid", "os.fork", "os.uname", "os.name", "sys.platform", "signal.SIGKILL"}
ONE_PLACE = {"assets/formats/file_names.py", "pipelines/caches.py"}  # names of files; the user's cache folder
WITHOUT_TOO = {
    "kernels/opencl/pocl_target.py",
    "pipelines/device_fallback.py",
}  # what Linux tells of the processor, or nothing


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(REPOSITORY)))
def test_systems_are_told_apart_in_one_place_and_nothing_is_of_one_alone(path):
    name = path.relative_to(REPOSITORY).as_posix()
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    modules = {alias.name.split(".")[0] for n in nodes if isinstance(n, ast.Import) for alias in n.names}
    modules |= {n.module.split(".")[0] for n in nodes if isinstance(n, ast.ImportFrom) and n.module}
    assert not modules & POSIX_ALONE
    used = {ast.unparse(n) for n in nodes if isinstance(n, ast.Attribute)}
    assert not used & POSIX_CALLS or name in ONE_PLACE
    texts = {n.value for n in nodes if isinstance(n, ast.Constant) and isinstance(n.value, str)}
    assert not any(text.startswith("/proc") for text in texts) or name in WITHOUT_TOO
