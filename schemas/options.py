"""One setting of a file: its default, what it means, what it may be."""

from __future__ import annotations

import math
from dataclasses import field, fields
from typing import Any


def key(
    default: Any,  # noqa: ANN401 - a default may be of any type
    meaning: str,
    *,
    values: tuple[object, ...] = (),
    least: float | None = None,
    most: float | None = None,
) -> Any:  # noqa: ANN401
    """Declare one setting: its default, its meaning, and what it may be (a closed list, or bounds).

    Parameters
    ----------
    default : any value that may be shared: a number, a text, a tuple
    meaning : str
        One sentence or two, shown in the list of settings.
    values : closed list of allowed values, or empty for any
    least, most : float or None
        Bounds, both allowed; None for no bound. ``most`` only with ``least``.

    Returns
    -------
    dataclasses.Field, as :func:`check` reads it
    """
    allowed = {"values": values, "least": least, "most": most}
    return field(default=default, metadata={"meaning": meaning, **allowed})


def check(record: object) -> None:
    """Refuse a record with a value its declaration does not allow; infinity and NaN never are.

    Parameters
    ----------
    record : instance of a dataclass
        Fields not declared by :func:`key` only must not be infinite or NaN.

    Raises
    ------
    ValueError
        Naming the first field that does not fit, and what it may be.
    """
    for declared in fields(record):  # type: ignore[arg-type]
        value, allowed = getattr(record, declared.name), declared.metadata
        least, most = allowed.get("least"), allowed.get("most")
        if isinstance(value, float) and not math.isfinite(value):
            raise ValueError(f"{declared.name}: want a finite number, got {value!r}")
        if allowed.get("values") and value not in allowed["values"]:
            raise ValueError(f"{declared.name}: want one of {', '.join(map(str, allowed['values']))}, got {value!r}")
        if (least is not None and not value >= least) or (most is not None and not value <= most):
            bounds = f"at least {least:g}" if most is None else f"{least:g} to {most:g}"
            raise ValueError(f"{declared.name}: want {bounds}, got {value!r}")
