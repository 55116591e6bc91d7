"""What the licences of the clips in a dance ask of the dance: the most restrictive wins.

SPDX names are read by their parts (``CC-BY-NC-4.0``); ``studio`` is a studio's own, not to be passed on; an empty one
is not known and counts as that.
"""

from collections.abc import Iterable
from dataclasses import dataclass

STUDIO = "studio"
_FREE = frozenset({"CC0-1.0", "0BSD", "MIT", "BSD-2-CLAUSE", "BSD-3-CLAUSE", "APACHE-2.0", "PDDL-1.0", "UNLICENSE"})


@dataclass(frozen=True, order=True)
class Terms:
    """What one licence, or several together, forbid and demand; compared from the freest to the most restrictive.

    Parameters
    ----------
    is_internal : may not leave the studio, or nobody said what it may
    no_derivatives : may not be changed: not warped, not blended with others
    non_commercial : may not be sold
    share_alike : what is made of it keeps its licence
    attribution : its author has to be named
    """

    is_internal: bool = False
    no_derivatives: bool = False
    non_commercial: bool = False
    share_alike: bool = False
    attribution: bool = False

    def __or__(self, other: "Terms") -> "Terms":
        """Terms of both together."""
        return Terms(*(getattr(self, n) or getattr(other, n) for n in self.__dataclass_fields__))

    def words(self) -> list[str]:
        """Name the terms, worst first; empty for none."""
        return [name.removeprefix("is_").replace("_", " ") for name in self.__dataclass_fields__ if getattr(self, name)]


def terms_of(licence: str) -> Terms:
    """Read the terms of a licence's name.

    Parameters
    ----------
    licence : SPDX name in any case, ``studio``, or a name with ``NC`` or ``ND`` among its parts; "" when not known

    Returns
    -------
    Terms
        Of a name that is none of these: attribution, and not to leave the studio until somebody has read it.
    """
    name = licence.strip().upper()
    parts = set(name.replace(" ", "-").split("-"))
    if name in _FREE:
        return Terms()
    known = parts & {"BY", "NC", "ND", "SA"}
    return Terms(
        is_internal=not known,
        no_derivatives="ND" in parts,
        non_commercial="NC" in parts,
        share_alike="SA" in parts,
        attribution=bool(known) or name not in ("", STUDIO.upper()),
    )


def together(licences: Iterable[str]) -> tuple[str, Terms]:
    """Find the licence that rules a dance made of clips of several.

    Parameters
    ----------
    licences : of the clips danced; "" where not known

    Returns
    -------
    licence : the most restrictive of them, of equal ones the first by name; ``studio`` for one that is not known,
        "" where nothing was danced
    terms : of all of them together
    """
    named = sorted({licence.strip() or STUDIO for licence in licences})
    terms = Terms()
    for licence in named:
        terms |= terms_of(licence)
    return max(named, key=lambda licence: (terms_of(licence), [-ord(c) for c in licence]), default=""), terms


def is_allowed(licence: str, allow: Iterable[str]) -> bool:
    """Whether a clip of this licence may be danced where only some are allowed; all are where none is named."""
    names = {name.strip().lower() for name in allow}
    return not names or (licence.strip() or STUDIO).lower() in names
