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
    """Print the page of the guide about TOPIC, or the list of all pages.

    Where the output is no terminal, it is the page's Markdown. A script that is here already is kept, unless it is the
    same.

    \b
    replay guide
    replay guide audit
    replay guide audit > audit.md
    replay guide unity --script
    """
    from replay.guide.pages import INDEX, find_topic, page, topics, write_scripts

    known = topics()
    found = INDEX if topic is None else find_topic(topic, known)
    if found is None:
        from sessions.scene_files.toml_table import nearest

        raise click.UsageError(f"the guide has no page {topic!r}{nearest(str(topic), known)}", context)
    if script:
        for path in write_scripts(found, Path.cwd()):
            click.echo(f"wrote {path.name}")
        return 0
    text = page(found)
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
