"""What ``run --format markdown`` prints: the answer for the page of a build, gates first, then who missed what."""

from collections.abc import Sequence

from replay.base.constants import CAVEAT
from replay.base.tables import Table, markdown, markdown_words
from replay.outputs.run_tables import ranking_table
from replay.pipeline.headline import doubts, headlines, price
from replay.pipeline.run_result import RunResult

LEVEL = 3
"""Heading of a table: the page of a build has headings of its own above."""


def run_markdown(result: RunResult, broken: Sequence[str]) -> str:
    """One session: which gates failed, what is wrong, the ranking, and what the reference takes."""
    size = f"{result.summary['session']['frames']:,} frames, {len(result.assembly.bodies)} bodies"
    answers = [f"**{words}**" for words in headlines(result)]
    tables = [ranking_table(result)] if len(result.comparisons) > 1 else []
    name = result.session.scene.name or "Session"
    return markdown_page(name, broken, [*doubts(result), size, *answers], tables, price(result))


def markdown_page(
    head: str, broken: Sequence[str], above: Sequence[str], tables: Sequence[Table], below: Sequence[str] = ()
) -> str:
    """Which gates failed, sentences, the tables, and sentences ``below`` them that are no note of a table."""
    gates = "\n".join(f"- **gate failed:** {markdown_words(sentence)}" for sentence in broken)
    parts = [f"## {markdown_words(head)}", gates, *map(markdown_words, above)]
    parts += [markdown(table, LEVEL) for table in tables]
    noted = {note for table in tables for note in table.notes}
    parts += [markdown_words(words) for words in below if words not in noted]
    return "\n\n".join([*filter(None, parts), f"*{CAVEAT}*"])
