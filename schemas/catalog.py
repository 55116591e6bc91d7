"""Every table by name."""

from __future__ import annotations

from schemas import choreography, graph, matching, motion, music
from schemas.table import Table

TABLES: dict[str, Table] = {
    value.name: value
    for module in (motion, music, graph, matching, choreography)
    for value in vars(module).values()
    if isinstance(value, Table)
}
