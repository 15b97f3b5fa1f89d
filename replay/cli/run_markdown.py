"""The output of ``run --format markdown``: the answer for the page of a build, gates first, then who missed what."""

from collections.abc import Sequence

from replay.document.run_result import Summarised
from replay.document.summary import CAVEAT
from replay.document.tables import Table, markdown, markdown_text
from replay.show.sections import Section, SectionName, details_markdown, section_of
from replay.words import plural

HEADING_LEVEL = 3
"""Heading of a table: the page of a build has headings of its own above."""


def run_markdown(result: Summarised, broken_limits: Sequence[str]) -> str:
    """One session: which gates failed, what is wrong, why, what mends it, the ranking, and what the reference takes."""
    session = result.document.session
    size_text = f"{plural(session.frames, 'frame')}, {plural(len(session.bodies), 'body', 'bodies')}"
    answer = section_of(result, SectionName.ANSWER)
    answers = [f"**{sentence}**" for sentence in answer.sentences[:1]]
    ranking = section_of(result, SectionName.RANKING)
    tables = ranking.tables if len(result.document.audit) > 1 else ()
    session_title = session.scene or "Session"
    return markdown_page(
        session_title,
        broken_limits,
        [size_text, *answers],
        tables,
        (*section_of(result, SectionName.SESSION).sentences, *ranking.sentences),
        reasons(answer),
        details_markdown(result),
    )


def reasons(answer: Section) -> list[str]:
    """Why the worst detector is wrong and what mends it, as list items in Markdown; nothing where nothing is wrong."""
    items = []
    for reason in answer.reasons:
        quoted_command = f" `{reason.command}`" if reason.command else ""
        text = " ".join(filter(None, [reason.text, reason.figures]))
        items.append(f"- **{reason.heading}** {markdown_text(text)}{quoted_command}")
    return items


def markdown_page(
    heading: str,
    broken_limits: Sequence[str],
    sentences_above: Sequence[str],
    tables: Sequence[Table],
    sentences_below: Sequence[str] = (),
    reasons: Sequence[str] = (),
    details: Sequence[str] = (),
) -> str:
    """Return failed gates, sentences, reasons in Markdown, the tables, sentences that are no table's note, details."""
    gate_lines = "\n".join(f"- **gate failed:** {markdown_text(sentence)}" for sentence in broken_limits)
    paragraphs = [f"## {markdown_text(heading)}", gate_lines, *map(markdown_text, sentences_above), "\n".join(reasons)]
    paragraphs += [markdown(table, HEADING_LEVEL) for table in tables]
    table_notes = {note for table in tables for note in table.notes}
    paragraphs += [markdown_text(sentence) for sentence in sentences_below if sentence not in table_notes]
    paragraphs += details
    return "\n\n".join([*filter(None, paragraphs), f"*{CAVEAT}*"])
