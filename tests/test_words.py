"""The words of the house: papers by key, terms by one name, nothing that only its writers understand."""

import re
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
PACKAGES = ("odori", "pipelines", "assets", "kernels", "schemas")
KEY = re.compile(r"\[([A-Z][A-Za-z]+(?:19|20)\d\d)\]")
REFERENCES = REPOSITORY / "docs" / "references.md"
PAGES = [REPOSITORY / "README.md", REPOSITORY / "CHANGELOG.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]
SOURCES = sorted(
    path
    for package in PACKAGES
    for path in (REPOSITORY / package).rglob("*")
    if path.suffix in {".py", ".cl"} and path.name != "pulse_weights.py"
)


def texts():
    for path in [*PAGES, *SOURCES]:
        yield str(path.relative_to(REPOSITORY)), path.read_text(encoding="utf-8")


def declared():
    return re.findall(r"^\*\*\[(\w+)\]\*\*", REFERENCES.read_text(encoding="utf-8"), flags=re.MULTILINE)


def test_every_paper_that_is_cited_is_in_the_references():
    known = set(declared())
    strange = {(name, key) for name, text in texts() for key in KEY.findall(text) if key not in known}
    assert not strange


def test_every_paper_of_the_references_is_cited_somewhere():
    cited = {key for name, text in texts() if name != "docs/references.md" for key in KEY.findall(text)}
    assert not set(declared()) - cited
    assert len(declared()) == len(set(declared()))


def test_every_reference_says_what_is_taken_from_it():
    entries = re.split(r"^\*\*\[", REFERENCES.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    assert not [entry[:20] for entry in entries if "*Taken:*" not in entry]


# What no reader outside can know: papers without a name, codes of a page that is not here.
NEVER = {
    "the document": re.compile(r"\bthe documents?\b", re.IGNORECASE),
    "codes of systems": re.compile(r"\bS[1-5]\b"),
    "private terms": re.compile(r"would do:|independent eye|waist of the hourglass|\bfor a waist\b", re.IGNORECASE),
}


@pytest.mark.parametrize("what", NEVER)
def test_nothing_is_said_that_only_its_writers_understand(what):
    lines = [
        f"{name}:{number}: {line.strip()}"
        for name, text in texts()
        for number, line in enumerate(text.splitlines(), 1)
        if NEVER[what].search(line)
    ]
    assert not lines


def test_the_index_of_decisions_lists_them_all():
    folder = REPOSITORY / "docs" / "decisions"
    listed = re.findall(r"^\| \[\d{4}\]\((.+?)\)", (folder / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert listed == sorted(path.name for path in folder.glob("0*.md"))


def test_the_glossary_is_in_order_and_says_each_word_once():
    text = (REPOSITORY / "docs" / "glossary.md").read_text(encoding="utf-8")
    words = [word.lower() for word in re.findall(r"^\*\*(.+?)\*\*", text, re.MULTILINE)]
    assert len(words) > 40
    assert words == sorted(set(words))
    assert "glossary.md" in (REPOSITORY / "README.md").read_text(encoding="utf-8")


def test_links_between_pages_lead_somewhere():
    broken = [
        f"{page.name}: {target}"
        for page in PAGES
        for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
        if "://" not in target and not (page.parent / target).exists()
    ]
    assert not broken
