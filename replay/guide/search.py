"""Sections of the guide by whole terms: rare terms count most, and those of headings more than those of the prose.

A section reaches from one heading to the next. Upper case and a trailing s do not count; comments of code do not match.
"""

import re
from collections import Counter
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from enum import IntEnum
from functools import cached_property
from math import log
from typing import Final

from replay.guide.pages import COMMENT_PATTERN, IMAGE_PATTERN, LINK_PATTERN

MOST_NEAR_TERMS: Final = 3
"""Near terms that are suggested for one without a section."""

LEVEL_WEIGHT: Final = 6
"""What a term counts beside its level: a term more outweighs a better level of another of its rarity."""

LEAST_SCORE_RATIO: Final = 0.5
"""Of the best score; sections of less do not answer."""

_TOKEN: Final = re.compile(r"\w+")
FILLER_TERMS: Final = frozenset(
    _TOKEN.findall(
        "a an and are as at be by can do does for how i in is it me my of on or the to what when where which why with"
    )
)
"""Left out of a query that holds anything else."""

EVERYDAY_TERMS: Final = {
    "crashed": "crash",
    "rescue": "recover",
    "restore": "recover",
    "repair": "recover",
    "compatible": "version",
    "compatibility": "version",
    "upgrade": "version",
    "cloud": "s3",
    "bucket": "s3",
    "upright": "axe",
    "sideways": "axe",
    "axis": "axe",
    "turned": "axe",
    "excel": "questionnaire",
    "survey": "questionnaire",
}
"""Terms of readers that no section holds -> terms of the guide, as `tokens` gives them."""

_HEADING: Final = re.compile(r"#{1,3} (.*)")
_BLOCK: Final = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_CODE_COMMENT: Final = re.compile(r"(?:^|(?<=\s))#.*$", re.MULTILINE)
_TABLE_HEAD: Final = re.compile(r"^\|.*\n\|[\s:|-]+$", re.MULTILINE)
_TERM: Final = re.compile(r"^\| *([^|]*)|\*\*(.+?)\*\*|`([^`]+)`", re.MULTILINE)


class Level(IntEnum):
    """Kinds of text of a section that may hold a term, the best last."""

    NOWHERE = 0
    PROSE = 1
    IN_TERM = 2
    """Within a longer first cell of a table, a longer bold or code term, or a command."""
    TERM = 3
    """A first cell, a bold or a code term by itself."""
    HEADING = 4


def tokens(text: str) -> list[str]:
    """The terms of a text in order, in lower case and without a trailing s."""
    return [token.lower().removesuffix("s") for token in _TOKEN.findall(text)]


@dataclass(frozen=True)
class Section:
    """A heading with what follows it up to the next one: ``text``, as Markdown."""

    topic: str
    title: str
    heading: str
    text: str

    @cached_property
    def counts(self) -> Counter[str]:
        """Term -> how often the section holds it."""
        return Counter(tokens(_readable(self.text)))

    @cached_property
    def levels(self) -> dict[str, Level]:
        """Term -> the best level at which the section holds it."""
        levels = dict.fromkeys(self.counts, Level.PROSE)
        for term in self._terms():
            term_tokens = tokens(term)
            level = Level.TERM if len(term_tokens) == 1 else Level.IN_TERM
            levels |= {token: max(level, levels.get(token, level)) for token in term_tokens}
        return levels | dict.fromkeys(tokens(self.heading), Level.HEADING)

    def _terms(self) -> Iterable[str]:
        prose = _TABLE_HEAD.sub("", _readable(_BLOCK.sub("", self.text)))
        for cell, bold, code in _TERM.findall(prose):
            yield from cell.replace("`", "").split(",") if cell else [bold or code]
        for language, body in _BLOCK.findall(self.text):
            if language == "bash":
                yield from (f"replay {line}" for line in _CODE_COMMENT.sub("", body).splitlines())

    @property
    def page(self) -> str:
        """The section as Markdown under the title of its page."""
        return self.text if self.heading == self.title else f"# {self.title}\n\n{self.text}"


@dataclass(frozen=True)
class Match:
    """A section and how well it answers.

    ``missing``: terms of the query that it lacks; ``score``: sum over those it holds, by rarity and level; ``named``:
    terms in the name of its page; ``count``: how often it holds them.
    """

    section: Section
    missing: tuple[str, ...]
    score: float
    named: int
    count: int

    @property
    def rank(self) -> tuple[float, int, int]:
        """Larger is better."""
        return self.score, self.named, self.count


def sections_of(topic: str, text: str) -> list[Section]:
    """The sections of a page in their order; the first has the page's title as its heading."""
    headings: list[str] = []
    bodies: list[list[str]] = []
    in_code = False
    for line in COMMENT_PATTERN.sub("", text).splitlines():
        in_code ^= line.startswith("```")
        heading = None if in_code else _HEADING.fullmatch(line)
        if heading:
            headings.append(heading[1])
            bodies.append([])
        if bodies:
            bodies[-1].append(line)
    return [
        Section(topic, title=headings[0], heading=heading, text="\n".join(body).strip() + "\n")
        for heading, body in zip(headings, bodies, strict=True)
    ]


def query_terms(query: Sequence[str]) -> list[str]:
    """The terms of a query as they are written, each once; fillers such as *how* only where there is nothing else."""
    written = {token.removesuffix("s"): token for token in _TOKEN.findall(" ".join(query).lower())}
    return [term for term in written.values() if term not in FILLER_TERMS] or list(written.values())


def search(query: Sequence[str], among: Iterable[Section]) -> list[Match]:
    """The sections that hold terms of the query, the best first: those of less than half the best score are left out.

    A term weighs as much as it is rare: the logarithm of all sections over those that hold it.
    """
    sections = list(among)
    known = {term for section in sections for term in section.levels}
    written = {_term_of_guide(tokens(term)[0], known): term for term in query_terms(query)}
    weights = {}
    for term in written:
        holding = sum(term in section.levels for section in sections)
        weights[term] = log((1 + len(sections)) / holding) if holding else 0.0
    matches = []
    for section in sections:
        present = [term for term in written if term in section.levels]
        if present:
            score = sum(weights[term] * (LEVEL_WEIGHT + section.levels[term]) for term in present)
            missing = tuple(spelling for term, spelling in written.items() if term not in section.levels)
            named = len(set(present).intersection(tokens(section.topic)))
            count = sum(section.counts[term] for term in present)
            matches.append(Match(section, missing=missing, score=score, named=named, count=count))
    least = LEAST_SCORE_RATIO * max((match.score for match in matches), default=0.0)
    return sorted((match for match in matches if match.score >= least), key=lambda match: match.rank, reverse=True)


def _term_of_guide(term: str, known: Container[str]) -> str:
    """A term of a query, or the guide's own term for one that no section holds."""
    return term if term in known else EVERYDAY_TERMS.get(term, term)


def near_terms(term: str, among: Iterable[Section]) -> list[str]:
    """Terms of the guide that are spelled like one; at most ``MOST_NEAR_TERMS``."""
    known = {token.lower() for section in among for token in _TOKEN.findall(_readable(section.text))}
    spelled = [token for token in sorted(known) if len(token) > 2 and not any(map(str.isdigit, token))]
    return get_close_matches(term.lower(), spelled, n=MOST_NEAR_TERMS, cutoff=0.6)


def _readable(text: str) -> str:
    """A text as it is searched: without pictures, targets of links and comments of code."""
    without = LINK_PATTERN.sub(r"\1", IMAGE_PATTERN.sub("", text))
    return _BLOCK.sub(lambda block: f"```\n{_CODE_COMMENT.sub('', block[2])}```", without)
