"""The output of ``run --format markdown``: the answer for the page of a build, gates first, then who missed what."""

from collections.abc import Sequence

from replay.document.run_result import Summarised
from replay.document.summary import CAVEAT
from replay.document.tables import Table, markdown, markdown_text
from replay.show.sections import Section, SectionName, details_markdown, section_of

LEVEL = 3
"""Heading of a table: the page of a build has headings of its own above."""


def run_markdown(result: Summarised, broken: Sequence[str]) -> str:
    """One session: which gates failed, what is wrong, why, what mends it, the ranking, and what the reference takes."""
    size = f"{result.document.session.frames:,} frames, {len(result.document.session.bodies)} bodies"
    answer = section_of(result, SectionName.ANSWER)
    answers = [f"**{sentence}**" for sentence in answer.sentences[:1]]
    ranking = section_of(result, SectionName.RANKING)
    tables = ranking.tables if len(result.document.audit) > 1 else ()
    name = result.document.session.scene or "Session"
    return markdown_page(
        name,
        broken,
        [size, *answers],
        tables,
        (*section_of(result, SectionName.SESSION).sentences, *ranking.sentences),
        reasons(answer),
        details_markdown(result),
    )


def reasons(answer: Section) -> list[str]:
    """Why the worst detector is wrong and what mends it, as list items in Markdown; nothing where nothing is wrong."""
    items = []
    for reason in answer.reasons:
        quoted = f" `{reason.command}`" if reason.command else ""
        text = " ".join(filter(None, [reason.text, reason.figures]))
        items.append(f"- **{reason.heading}** {markdown_text(text)}{quoted}")
    return items


def markdown_page(
    head: str,
    broken: Sequence[str],
    above: Sequence[str],
    tables: Sequence[Table],
    below: Sequence[str] = (),
    reasons: Sequence[str] = (),
    details: Sequence[str] = (),
) -> str:
    """Return failed gates, sentences, reasons in Markdown, the tables, sentences that are no table's note, details."""
    gates = "\n".join(f"- **gate failed:** {markdown_text(sentence)}" for sentence in broken)
    paragraphs = [f"## {markdown_text(head)}", gates, *map(markdown_text, above), "\n".join(reasons)]
    paragraphs += [markdown(table, LEVEL) for table in tables]
    noted = {note for table in tables for note in table.notes}
    paragraphs += [markdown_text(sentence) for sentence in below if sentence not in noted]
    paragraphs += details
    return "\n\n".join([*filter(None, paragraphs), f"*{CAVEAT}*"])
