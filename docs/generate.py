"""Write docs/data.md and docs/settings.md from the declarations, so that they cannot lag behind."""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path

from schemas.catalog import TABLES
from schemas.settings import Brief, Settings
from schemas.table import Table

HERE = Path(__file__).parent


def data() -> str:
    """Every table: what a row is, its key, its columns with types, units and meanings."""
    parts = [
        "# The tables\n\nMade by `make docs` from `schemas/`. Files: `lake/<table>/<partition>.parquet`; tables not\n"
        "cut are `all.parquet`, those of a song and a method `<song>|<method>.parquet` (on Windows `%7C` for `|`).\n"
        "Frame tables have one row a frame; per-joint values are in the order of the schema metadata `joints`.\n"
    ]
    return "\n".join([*parts, *(_table(table) for table in TABLES.values())])


def _table(table: Table) -> str:
    lines = [
        f"## {table.name}\n",
        f"{table.meaning} Key: {', '.join(f'`{k}`' for k in table.key)}. Version {table.version}.\n",
    ]
    lines += ["| column | type | unit | null | meaning |", "|---|---|---|---|---|"]
    for c in table.columns:
        kind = str(c.type).replace("item: ", "").replace("element: ", "")
        lines.append(f"| `{c.name}` | {kind} | {c.unit} | {'yes' if c.is_optional else ''} | {c.meaning} |")
    return "\n".join(lines) + "\n"


def settings() -> str:
    """Every key of ``odori.toml`` and of a song's brief: default, bounds, meaning."""
    text = (
        "# Settings\n\nMade by `make docs` from `schemas/settings.py`. Every key has a default; an unknown key is an "
    )
    text += "error. Papers by [key](references.md), words in the [glossary](glossary.md).\n"
    for title, record in (("`odori.toml`", Settings()), ("`songs/NAME.brief.toml`", Brief())):
        text += f"\n## {title}\n\n| key | default | meaning |\n|---|---|---|\n" + "".join(_keys(record, ""))
    return text


def _keys(record: object, section: str) -> Iterator[str]:
    for field in fields(record):  # type: ignore[arg-type]
        value = getattr(record, field.name)
        name = f"{section}.{field.name}" if section else field.name
        if is_dataclass(value):
            yield from _keys(value, name)
        else:
            shown = f'"{value}"' if isinstance(value, str) else "[]" if value == () else "{}" if value == {} else value
            yield f"| `{name}` | `{shown}` | {field.metadata['meaning']} |\n"


if __name__ == "__main__":
    (HERE / "data.md").write_text(data())
    (HERE / "settings.md").write_text(settings())
