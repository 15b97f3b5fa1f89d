"""What ``run --format markdown`` prints: the answer for the page of a build, gates first, then who missed what."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from replay.base.constants import CAVEAT
from replay.outputs.tables import Table, markdown, markdown_words
from replay.pipeline.headline import doubts, headlines, price

if TYPE_CHECKING:
    from replay.pipeline.run_result import RunResult

LEVEL = 3
"""Heading of a table: the page of a build has headings of its own above."""


def run_markdown(result: "RunResult", broken: Sequence[str]) -> str:
    """One session: which gates failed, what is wrong, the ranking, and what the reference takes."""
    from replay.outputs.run_tables import ranking_table

    name = result.session.scene.name or "Session"
    lines = [f"{result.summary['session']['frames']:,} frames, {len(result.assembly.bodies)} bodies"]
    lines += [f"**{words}**" for words in map(markdown_words, headlines(result))]
    tables = [ranking_table(result)] if len(result.comparisons) > 1 else []
    return _page(name, broken, [*map(markdown_words, doubts(result)), *lines], tables, price(result))


def batch_markdown(head: str, broken: Sequence[str], lines: Sequence[str], tables: Sequence[Table]) -> str:
    """Several sessions: which gates failed, what could not be replayed, and the tables over all of them."""
    return _page(head, broken, [markdown_words(words) for words in lines if words], tables, ())


def _page(head: str, broken: Sequence[str], above: Sequence[str], tables: Sequence[Table], below: Sequence[str]) -> str:
    gates = "\n".join(f"- **gate failed:** {markdown_words(sentence)}" for sentence in broken)
    parts = [f"## {markdown_words(head)}", *([gates] if gates else []), *above]
    parts += [markdown(made, LEVEL) for made in tables]
    noted = {note for made in tables for note in made.notes}
    parts += [markdown_words(words) for words in below if words not in noted]
    return "\n\n".join([*parts, f"*{CAVEAT}*"])
