"""``replay tradeoff``: what accuracy costs in time, over every detector and its settings; and which one to take."""

from __future__ import annotations

import json
from pathlib import Path

import click

from replay.cli.console import People, stdout_console
from replay.cli.options import ANY_PATH, SESSION_FILE, common, output_format, window


@click.command()
@click.argument("session", type=SESSION_FILE, metavar="SESSION")
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help="Folder for table, picture, and advice.")
@click.option("--force", is_flag=True, help="Replace an earlier folder of that name.")
@click.option("--oracle", metavar="SPEC", default="exact", show_default=True, help="The detector to trust.")
@window
@click.option("--seed", type=int, default=0, show_default=True, help="Of every random stream.")
@click.option("--repeats", type=click.IntRange(min=1), default=3, show_default=True, help="Timed passes of each.")
@click.option(
    "--time-limit", type=click.FloatRange(min=0), metavar="SECONDS", default=150.0, show_default=True,
    help="Begin nothing that cannot end by then.",
)  # fmt: skip
@output_format
@common
def command(
    session: Path,
    out: Path | None,
    force: bool,
    oracle: str,
    start: float | None,
    end: float | None,
    seed: int,
    repeats: int,
    time_limit: float,
    format_: str,
    verbose: bool,
    quiet: bool,
    debug: bool,
) -> int:
    """Run every detector with every setting of a fixed list over SESSION: recall against time, front, advice.

    \b
    replay tradeoff session.mcap --out costs
    replay tradeoff session.mcap --time-limit 60 --format json
    """
    del debug
    people = People(quiet=quiet, verbose=verbose)
    from replay.cli.tradeoff_tables import FrontBar, tradeoff_table
    from replay.tradeoff.output import check_tradeoff_target, write_tradeoff_folder
    from replay.tradeoff.trading import tradeoff
    from sessions import read_session

    if out is not None:
        check_tradeoff_target(out, force=force)
    with FrontBar(people) as bar:
        done = tradeoff(
            read_session(session),
            oracle=oracle,
            start=start,
            end=end,
            seed=seed,
            repeats=repeats,
            time_limit=time_limit,
            watch=bar.watch,
        )
    if out is not None:
        write_tradeoff_folder(done, out, force=force)
    if format_ == "json":
        click.echo(json.dumps(done.as_json(), allow_nan=False))
    else:
        stdout_console().print(tradeoff_table(done, everything=verbose))
        for sentence in done.advice:
            click.echo(sentence)
    if done.cut:
        people.say(f"time limit: {len(done.cut)} settings were not tried: {', '.join(done.cut)}")
    if out is not None:
        people.say(f"\nwrote {out}\nlook at:  {out / 'tradeoff.png'}")
    return 0
