"""Assets that store declared tables: name, meaning, columns and versions are declared once, for every asset alike."""

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import dagster as dg

from assets.dancing.chosen_steps import Markdown
from assets.dancing.method import Method
from assets.dancing.refusal import RefusalError
from schemas.table import Table

# Backfill policies are beta in the Dagster this is pinned to; its warning would stand in front of every command.
warnings.filterwarnings("ignore", category=dg.BetaWarning)

# Where freshness reads what an asset depends on besides its inputs.
SETTINGS_KEY = "odori/settings"
SOURCES_KEY = "odori/sources"
METHODS_KEY = "odori/methods"
KEEPS_KEY = "odori/keeps"
ONLY_FOR_KEY = "odori/only_for"


def table_asset(
    table: Table,
    *,
    group: str,
    code_version: str,
    settings: str = "",
    sources: str = "",
    partitions: dg.PartitionsDefinition[str] | None = None,
    ins: Mapping[str, dg.AssetIn] | None = None,
    checks: Mapping[str, str] | None = None,
    methods: Mapping[str, Method] | None = None,
    only_for: str = "",
    io_manager: str = "lake",
    keeps: bool = False,
) -> Callable[[Callable[..., Any]], dg.AssetsDefinition]:
    """Declare an asset that stores a table of its own name.

    Parameters
    ----------
    table : the declaration
    group : area of the asset graph
    code_version : raised by hand when the meaning of the output changes
    settings : sections of ``odori.toml`` it reads, or single keys as ``section.key``, separated by spaces
    sources : "clips", "song", "request" or "character" when it reads source files of its partition
    partitions : how it is cut; many sessions or songs are made in one run
    ins : inputs whose partitions do not match its own
    checks : asset checks it yields, by name, each with what it believes
    methods : of a dance, the methods it is chosen by: each says which of the inputs and settings it reads, and has a
        version of its own in place of `code_version`
    only_for : the one method of dancing it is made for; made where that is used, see ``pipelines/freshness.py``
    io_manager : who stores it
    keeps : once made it stays when its inputs change; only its code, its settings or a person make it anew
    """
    made: Callable[[Callable[..., Any]], dg.AssetsDefinition] = dg.asset(
        name=table.name,
        group_name=group,
        code_version=code_version,
        description=table.meaning,
        metadata=_metadata(table, settings, sources, only_for, methods or {}, keeps=keeps),
        io_manager_key=io_manager,
        partitions_def=partitions,
        backfill_policy=_backfill(partitions),
        ins=ins or {},
        check_specs=[dg.AssetCheckSpec(n, asset=table.name, description=w) for n, w in (checks or {}).items()],
    )
    return made


def table_assets(
    name: str,
    tables: Sequence[Table],
    *,
    group: str,
    code_version: str,
    settings: str = "",
    sources: str = "",
    partitions: dg.PartitionsDefinition[str] | None = None,
    ins: Mapping[str, dg.AssetIn] | None = None,
    checks: Mapping[str, tuple[Table, str]] | None = None,
    only_for: str = "",
) -> Callable[[Callable[..., Any]], dg.AssetsDefinition]:
    """Declare assets made in one pass, stored in the order of ``tables``.

    Parameters
    ----------
    name : of the pass
    tables : declarations, one an asset
    group, code_version, settings, sources, partitions, ins, only_for
        As for :func:`table_asset`.
    checks : by name, the table a check is about and what it says
    """
    made: Callable[[Callable[..., Any]], dg.AssetsDefinition] = dg.multi_asset(
        name=name,
        outs={
            table.name: dg.AssetOut(
                group_name=group,
                code_version=code_version,
                description=table.meaning,
                metadata=_metadata(table, settings, sources, only_for),
                io_manager_key="lake",
            )
            for table in tables
        },
        partitions_def=partitions,
        backfill_policy=_backfill(partitions),
        ins=ins or {},
        check_specs=[dg.AssetCheckSpec(n, asset=t.name, description=w) for n, (t, w) in (checks or {}).items()],
    )
    return made


def _backfill(partitions: dg.PartitionsDefinition[str] | None) -> dg.BackfillPolicy | None:
    return dg.BackfillPolicy.single_run() if isinstance(partitions, dg.DynamicPartitionsDefinition) else None


def _metadata(
    table: Table,
    settings: str,
    sources: str,
    only_for: str = "",
    methods: Mapping[str, Method] | None = None,
    *,
    keeps: bool = False,
) -> dict[str, Any]:
    said: dict[str, Any] = {"dagster/column_schema": column_schema(table), SETTINGS_KEY: settings, SOURCES_KEY: sources}
    if only_for:
        said[ONLY_FOR_KEY] = only_for
    if keeps:
        said[KEEPS_KEY] = "true"
    if methods:
        said[METHODS_KEY] = {
            name: {"version": method.version, "inputs": list(method.inputs), "settings": list(method.settings)}
            for name, method in methods.items()
        }
    return said


def column_schema(table: Table) -> dg.TableSchema:
    """List a table's columns as Dagster's UI shows them.

    Parameters
    ----------
    table : its declaration
    """
    columns = []
    for column in table.columns:
        meaning = f"{column.meaning} [{column.unit}]" if column.unit else column.meaning
        constraints = dg.TableColumnConstraints(nullable=column.is_optional, unique=table.key == (column.name,))
        columns.append(dg.TableColumn(column.name, str(column.type), meaning, constraints))
    return dg.TableSchema(columns)


def code_version(context: dg.AssetExecutionContext, asset: str) -> str:
    """Read the code version of an asset of this run.

    Parameters
    ----------
    context : of the step
    asset : name of one of the assets it makes

    Returns
    -------
    str
        Empty where the asset declares none.

    Raises
    ------
    KeyError
        If the step makes no such asset.
    """
    return context.assets_def.code_versions_by_key[dg.AssetKey(asset)] or ""


@contextmanager
def refusals_fail() -> Iterator[None]:
    """Turn a refusal into a failure of the run: its sentence for a person, its facts for a machine.

    Raises
    ------
    dagster.Failure
        In place of a :class:`assets.dancing.refusal.RefusalError`; it is not tried again.
    """
    try:
        yield
    except RefusalError as refused:
        raise dg.Failure(refused.sentence, metadata=shown(refused.facts), allow_retries=False) from refused


def shown(metadata: Mapping[str, Any]) -> dict[str, Any]:
    """Make metadata of plain values ready for Dagster's pages.

    Parameters
    ----------
    metadata : numbers, texts, Markdown, and lists and mappings of these
    """
    return {name: _shown(value) for name, value in metadata.items()}


def _shown(value: Any) -> Any:  # noqa: ANN401 - metadata are of many types
    if isinstance(value, Markdown):
        return dg.MetadataValue.md(value)
    return dg.MetadataValue.json(value) if isinstance(value, list | tuple | dict) else value
