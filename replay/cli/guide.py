"""``replay guide``: the pages of the guide in the terminal."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

if TYPE_CHECKING:
    from replay.guide.search import Match

from replay.cli.options import common

WIDEST_PAGE_COLUMNS: Final = 100
"""Columns: longer lines of prose are hard to read."""


COLUMNS_PAGE: Final = "columns"
"""The page that is made from the declaration of the tables' columns."""

MOST_OTHER_SECTIONS: Final = 5
"""Other sections that are named below the best one."""


@click.command()
@click.argument("query", nargs=-1, metavar="[WORD]...")
@click.option("--script", is_flag=True, help="Write the scripts of the page into this folder, those for Unity.")
@common
@click.pass_context
def command(context: click.Context, /, query: tuple[str, ...], script: bool, **_: bool) -> int:
    """Print the page of the guide that is named WORD, else the section that answers best to the words, or the list of
    all pages.

    Rare words count most, and headings more than the rest; only whole words match. A pipe or a file gets Markdown.
    --script never replaces another file.

    \b
    replay guide
    replay guide what-is-wrong
    replay guide what-is-wrong > page.md
    replay guide unity csv
    replay guide columns
    replay guide unity --script
    """
    from replay.guide.pages import INDEX_PAGE, page, topics, write_scripts

    page_name = "-".join(query) or INDEX_PAGE
    if page_name == COLUMNS_PAGE:
        from replay.show.column_list import columns_page

        topic, text = page_name, columns_page()
    elif page_name == INDEX_PAGE or page_name in topics():
        topic, text = page_name, page(page_name)
    else:
        topic, text = _best_section(context, query)
    if script:
        for path in write_scripts(topic, Path.cwd()):
            click.echo(f"wrote {path.name}")
        return 0
    if sys.stdout.isatty():
        _print_page(text)
    else:
        click.echo(text, nl=False)
    return 0


def _best_section(context: click.Context, query: Sequence[str]) -> tuple[str, str]:
    """The page of the section that answers best, and that section with a line that names the others."""
    from replay.guide.pages import page, topics
    from replay.guide.search import near_terms, query_terms, search, sections_of

    sections = [section for topic in topics() for section in sections_of(topic, page(topic))]
    matches = search(query, sections)
    terms = query_terms(query)
    if not matches:
        near_spellings = dict.fromkeys(spelling for term in terms for spelling in near_terms(term, sections))
        advice = f"near words: {', '.join(near_spellings)}" if near_spellings else "`replay guide` lists its pages"
        raise click.UsageError(f"the guide has no section about {' '.join(query)!r}; {advice}", context)
    best_match, *other_matches = matches
    missing_terms = [term for term in best_match.missing if term.isidentifier()]
    if 2 * len(best_match.missing) > len(terms):  # a whole section about something else would mislead
        missing_text = ", ".join(missing_terms) or "most of these words"
        heading = f"No section holds {missing_text}. The nearest, and the page to open:\n"
        return best_match.section.topic, "\n".join([heading, *_pages_to_open(matches)])
    lines = []
    if missing_terms:
        lines.append(f"Not in this section: {', '.join(missing_terms)}.\n")
    lines.append(best_match.section.page)
    if other_matches:
        lines.append("Other sections, and the page to open:\n")
        lines += _pages_to_open(other_matches)
    return best_match.section.topic, "\n".join(lines)


def _pages_to_open(matches: "Sequence[Match]") -> list[str]:
    """A line for each of the best sections, with the command that prints its page, and an empty one."""
    return [
        *(
            f"- {match.section.heading}: `replay guide {match.section.topic}`"
            for match in matches[:MOST_OTHER_SECTIONS]
        ),
        "",
    ]


def _print_page(page_text: str) -> None:
    from rich.console import Console
    from rich.markdown import Markdown

    from replay.guide.pages import for_terminal

    console = Console()
    console.print(Markdown(for_terminal(page_text), hyperlinks=False), width=min(console.width, WIDEST_PAGE_COLUMNS))
