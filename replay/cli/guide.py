"""``replay guide``: the pages of the guide in the terminal."""

import sys
from pathlib import Path
from typing import Final

import click

from replay.cli.options import common

WIDEST: Final = 100
"""Columns: longer lines of prose are hard to read."""


@click.command()
@click.argument("topic", required=False, metavar="[TOPIC]")
@click.option("--script", is_flag=True, help="Write the scripts of the page into this folder, those for Unity.")
@common
@click.pass_context
def command(context: click.Context, /, topic: str | None, script: bool, **_: bool) -> int:
    """Print the page of the guide about TOPIC, a page's name or a word of its headings, or the list of all pages.

    A pipe or a file gets the page's Markdown. --script never replaces another file.

    \b
    replay guide
    replay guide what-is-wrong
    replay guide what-is-wrong > page.md
    replay guide unity --script
    """
    from replay.guide.pages import INDEX, find_topic, page, topics, write_scripts

    known = topics()
    name = INDEX if topic is None else find_topic(topic, {each: page(each) for each in known})
    if name is None:
        from sessions.scene_files.toml_table import nearest

        raise click.UsageError(f"the guide has no page {topic!r}{nearest(str(topic), known)}", context)
    if script:
        for path in write_scripts(name, Path.cwd()):
            click.echo(f"wrote {path.name}")
        return 0
    text = page(name)
    if sys.stdout.isatty():
        _show(text)
    else:
        click.echo(text, nl=False)
    return 0


def _show(text: str) -> None:
    from rich.console import Console
    from rich.markdown import Markdown

    from replay.guide.pages import for_terminal

    console = Console()
    console.print(Markdown(for_terminal(text), hyperlinks=False), width=min(console.width, WIDEST))
