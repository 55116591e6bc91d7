"""Every table by name."""

from __future__ import annotations

from schemas import calibration, choreography, graph, hmm, matching, motion, music, search
from schemas.table import Table

TABLES: dict[str, Table] = {
    value.name: value
    for module in (motion, calibration, music, graph, hmm, matching, search, choreography)
    for value in vars(module).values()
    if isinstance(value, Table)
}
