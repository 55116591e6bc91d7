"""What the licences of the clips in a dance ask of the dance: the most restrictive wins.

SPDX names are read by their parts (``CC-BY-NC-4.0``) and joined by ``AND``, ``OR`` and ``WITH``; ``studio`` is a
studio's own, not to be passed on; one that is not known, or that nobody named, counts as that.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

STUDIO = "studio"
_FREE = frozenset(
    [
        "CC0-1.0",
        "CC0",
        "0BSD",
        "MIT",
        "MIT-0",
        "ISC",
        "ZLIB",
        "BSD-2-CLAUSE",
        "BSD-3-CLAUSE",
        "APACHE-2.0",
        "PDDL-1.0",
        "UNLICENSE",
        "WTFPL",
    ]
)
_SHARE_ALIKE = re.compile(r"(A|L)?GPL-|MPL-|EUPL-|ODBL-|CDLA-SHARING-")
_COMMONS = re.compile(r"(CC-)?(BY|NC|ND|SA)(-(BY|NC|ND|SA))*(-\d+(\.\d+)*)?(-[A-Z]{2,3})?")
"""A licence of Creative Commons, or its terms alone; whole, because ``by`` is a word as well."""
_TOKEN = re.compile(r"\(|\)|[^\s()]+")


@dataclass(frozen=True, order=True)
class LicenceTerms:
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

    def __or__(self, other: "LicenceTerms") -> "LicenceTerms":
        """Join the terms of both."""
        return LicenceTerms(*(getattr(self, n) or getattr(other, n) for n in self.__dataclass_fields__))

    def words(self) -> list[str]:
        """Name the terms, worst first; empty for none."""
        return [name.removeprefix("is_").replace("_", " ") for name in self.__dataclass_fields__ if getattr(self, name)]


def terms_of(licence: str) -> LicenceTerms:
    """Read the terms of a licence's name.

    Parameters
    ----------
    licence : SPDX name or expression in any case, ``studio``, or a name with ``NC`` or ``ND`` among its parts; "" when
        not known

    Returns
    -------
    LicenceTerms
        Of ``A AND B`` both, of ``A OR B`` the freer. Of a name that is none of these: attribution, and not to leave the
        studio until somebody has read it.
    """
    words = _TOKEN.findall(licence.strip().upper())
    if {"AND", "OR", "WITH"} & set(words):
        terms, rest = _either(words)
        return terms if not rest else LicenceTerms(is_internal=True, attribution=True)
    return _terms_of_name(licence.strip().upper())


def _either(words: list[str]) -> tuple[LicenceTerms, list[str]]:
    """Read ``A OR B …``: the freest; what is left of the words comes back too."""
    terms, rest = _both(words)
    while rest[:1] == ["OR"]:
        other, rest = _both(rest[1:])
        terms = min(terms, other)
    return terms, rest


def _both(words: list[str]) -> tuple[LicenceTerms, list[str]]:
    """Read ``A AND B …``: the terms of all."""
    terms, rest = _one(words)
    while rest[:1] == ["AND"]:
        other, rest = _one(rest[1:])
        terms |= other
    return terms, rest


def _one(words: list[str]) -> tuple[LicenceTerms, list[str]]:
    """Read one name, or an expression in brackets; an exception (``WITH …``) changes nothing here."""
    if words[:1] == ["("]:
        terms, rest = _either(words[1:])
        rest = rest[1:] if rest[:1] == [")"] else ["("]
    else:
        terms, rest = _terms_of_name(words[0] if words else ""), words[1:]
    return terms, rest[2:] if rest[:1] == ["WITH"] else rest


def _terms_of_name(name: str) -> LicenceTerms:
    if name in _FREE:
        return LicenceTerms()
    if _SHARE_ALIKE.match(name):
        return LicenceTerms(share_alike=True, attribution=True)
    parts = set(name.replace(" ", "-").split("-"))
    return LicenceTerms(
        is_internal=not _COMMONS.fullmatch(name.replace(" ", "-")),
        no_derivatives="ND" in parts,
        non_commercial="NC" in parts,
        share_alike="SA" in parts,
        attribution=name not in ("", STUDIO.upper()),
    )


def together(licences: Iterable[str]) -> tuple[str, LicenceTerms]:
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
    terms = LicenceTerms()
    for licence in named:
        terms |= terms_of(licence)
    return max(named, key=lambda licence: (terms_of(licence), [-ord(c) for c in licence]), default=""), terms


def report(licence_of: Mapping[str, str]) -> dict[str, object]:
    """Say under which terms a dance may be used, for its stage and its report.

    Parameters
    ----------
    licence_of : licence of each clip danced; "" where nobody named one

    Returns
    -------
    dict
        ``name`` and ``terms`` of :func:`together`; ``clips`` by licence; ``unknown``, the clips without one or with one
        that is not known; and ``sentence`` for a person.
    """
    name, terms = together(licence_of.values())
    by_licence: dict[str, list[str]] = {}
    for clip, licence in sorted(licence_of.items()):
        by_licence.setdefault(licence.strip() or "unknown", []).append(clip)
    unknown = [clip for clip, licence in sorted(licence_of.items()) if _is_unknown(licence)]
    said = [_WORDS[word] for word in terms.words()]
    sentence = "; ".join(said) if said else "free to use"
    if unknown:
        sentence += (
            f"; {len(unknown)} of {len(licence_of)} clips have no licence that is known and count as the studio's own"
        )
    keep = [licence for licence in by_licence if terms_of(licence).share_alike]
    if len(keep) > 1:
        sentence += f"; {', '.join(keep)} each want the whole under their own terms"
    elif keep and terms != terms_of(keep[0]):
        sentence += f"; {keep[0]} wants the whole under its own terms, which the others do not allow"
    return {"name": name, "terms": terms.words(), "clips": by_licence, "unknown": unknown, "sentence": sentence}


_WORDS = {
    "internal": "not to leave the studio",
    "no derivatives": "not to be changed",
    "non commercial": "not for sale",
    "share alike": "to be passed on under the same licence",
    "attribution": "authors to be named",
}


def _is_unknown(licence: str) -> bool:
    """Whether nobody named a licence, or one that says nothing here; a studio's own is known."""
    return terms_of(licence).is_internal and licence.strip().lower() != STUDIO


def may_be_joined(licence: str) -> bool:
    """Whether a clip may be blended with others: not where its licence forbids to change it."""
    return not terms_of(licence).no_derivatives


def free_to_join(licence_of: Mapping[str, str], allow: Iterable[str]) -> set[str]:
    """Find the clips that may be danced in pieces, blended with others.

    Parameters
    ----------
    licence_of : licence by clip
    allow : licences that may be danced; all where empty

    Returns
    -------
    set of clips
        Those of an allowed licence that may be changed.
    """
    allowed = tuple(allow)
    return {clip for clip, name in licence_of.items() if is_allowed(name, allowed) and may_be_joined(name)}


def is_allowed(licence: str, allow: Iterable[str]) -> bool:
    """Whether a clip of this licence may be danced where only some are allowed; all are where none is named.

    Parameters
    ----------
    licence : its name, in any case; "" counts as ``studio``
    allow : names in any case, compared whole: expressions are not taken apart
    """
    names = {name.strip().lower() for name in allow}
    return not names or (licence.strip() or STUDIO).lower() in names
