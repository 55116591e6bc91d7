"""The house's own rules, kept by machine."""

import ast
import importlib.util
import re
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
PACKAGES = ("pipelines", "assets", "kernels", "schemas")
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
        if path.name == "__init__.py":
            assert re.fullmatch(r'"""[^"]+"""\n', path.read_text()), path


# Declarations, plain records and the thinnest glue are tested where they are used.
TESTED_ELSEWHERE = {
    "assets/danced.py",  # a record
    "schemas/options.py",  # in test_settings.py
    "assets/capture.py",
    "assets/choreography.py",
    "assets/dance.py",
    "assets/declare.py",
    "assets/graph.py",
    "assets/matching.py",
    "assets/hmm.py",
    "assets/hmm_path.py",
    "assets/hmm_pins.py",  # in tests/pipelines/test_hmm.py
    "assets/hmm_recordings.py",
    "assets/motion.py",
    "assets/search.py",
    "assets/music.py",
    "assets/partitions.py",
    "assets/formats/errors.py",
    "kernels/music/pulse_weights.py",
    "kernels/synthetic/grooves.py",
    "pipelines/cli.py",
    "pipelines/collection.py",
    "pipelines/freshness.py",
    "pipelines/hmm_report.py",
    "pipelines/io_managers.py",
    "pipelines/jobs.py",
    "pipelines/outcome.py",
    "pipelines/progress.py",
    "pipelines/resources.py",
    "pipelines/schedules.py",
    "pipelines/searchable.py",
    "schemas/calibration.py",
    "schemas/choreography.py",
    "schemas/fields.py",
    "schemas/graph.py",
    "schemas/hmm.py",
    "schemas/matching.py",
    "schemas/motion.py",
    "schemas/music.py",
    "schemas/search.py",
    "schemas/usd.py",
}


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


# Every public function of these tells its arguments and its errors; the list grows until it is kernels.
DOCUMENTED = [
    *(REPOSITORY / "kernels" / "assembly").glob("*.py"),
    *(REPOSITORY / "kernels" / "calibration").glob("*.py"),
    *(REPOSITORY / "kernels" / "matching").glob("*.py"),
    *(REPOSITORY / "assets" / f"{name}.py" for name in ("matching", "matching_plots", "matching_tables", "sequence")),
    *(REPOSITORY / "kernels" / f"{name}.py" for name in ("graph/costs", "graph/prune", "graph/transitions")),
    *(REPOSITORY / "kernels" / f"{name}.py" for name in ("skeleton/axes", "skeleton/kinematics", "motion/velocity")),
]


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
        named = [a.arg for a in (*node.args.args, *node.args.kwonlyargs) if a.arg != "self"]
        if named and "Parameters\n---" not in text and "arguments and errors are theirs" not in text:
            missing.append(f"{node.name}: Parameters")
        if any(isinstance(n, ast.Raise) for n in ast.walk(node)) and "Raises\n---" not in text:
            missing.append(f"{node.name}: Raises")
    assert missing == []
