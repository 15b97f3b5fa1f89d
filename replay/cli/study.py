"""``replay study``: what students did beside what they answered, and printed tables recomputed."""

from __future__ import annotations

import json
from pathlib import Path

import click

from replay.cli.console import People, stdout_console
from replay.cli.options import ANY_PATH, SESSION_FILE, common, output_format
from replay.cli.study_runs import collect_runs, demo_class, require_extra, run_sessions


@click.group()
def command() -> None:
    """Join what students did with what they answered; check printed tables.

    Needs the extra `study`:  pip install "vrlab-replay[study]"
    """


for _name, _verb in {"run": run_sessions, "collect": collect_runs, "demo": demo_class}.items():
    command.add_command(_verb, _name)


@command.command()
@click.argument("metrics", type=SESSION_FILE, metavar="METRICS.parquet")
@click.argument("questionnaire", type=SESSION_FILE, metavar="QUESTIONNAIRE.csv")
@click.option("--codebook", type=SESSION_FILE, required=True, metavar="FILE.yaml", help="What is asked of which items.")
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help="Study folder to make: page, tables, JSON.")
@click.option("--detector", metavar="NAME", help="Whose contacts count. Default: the one that misses least.")
@click.option("--title", default="Study", show_default=True, help="Heading of the page.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of bootstrap and permutations.")
@click.option("--force", is_flag=True, help="Replace an earlier study folder of that name.")
@output_format
@common
def analyse(
    metrics: Path,
    questionnaire: Path,
    codebook: Path,
    out: Path | None,
    detector: str | None,
    title: str,
    seed: int,
    force: bool,
    format_: str,
    verbose: bool,
    quiet: bool,
    debug: bool,
) -> int:
    """Reliability of the questionnaire and the associations its codebook asks about.

    \b
    replay study analyse metrics.parquet answers.csv --codebook codebook.yaml --out study1
    """
    del debug
    require_extra()
    people = People(quiet=quiet, verbose=verbose)
    from replay.study.analysis import analyse as work
    from replay.study.codebook import read_codebook
    from replay.study.folder import as_json, check_study_target, write_study
    from replay.study.joining import read_metrics, read_questionnaire

    if out is not None:
        check_study_target(out, force=force)
    book = read_codebook(codebook)
    people.say("resampling students")
    study = work(book, read_questionnaire(questionnaire, book), read_metrics(metrics), detector=detector, seed=seed)
    if out is not None:
        inputs = {"metrics": metrics, "questionnaire": questionnaire, "codebook": codebook}
        write_study(study, out, title=title, inputs=_digests(inputs, seed), force=force)
    if format_ == "json":
        click.echo(json.dumps(as_json(study), indent=1, allow_nan=False))
    else:
        from replay.cli.study_tables import study_tables

        stdout_console().print(study_tables(study))
    if out is not None:
        people.say(f"\nwrote {out}\nread it:  {out / 'study.html'}")
    return 0


def _digests(inputs: dict[str, Path], seed: int) -> dict[str, str]:
    import hashlib

    told = {name: f"sha256:{hashlib.sha256(path.read_bytes()).hexdigest()}" for name, path in inputs.items()}
    return {**told, "seed": str(seed)}


@command.command()
@click.argument("tables", type=SESSION_FILE, metavar="[TABLES.toml]", required=False)
@click.option("--strict", is_flag=True, help="Exit with 4 when figures contradict each other.")
@output_format
@common
def check(tables: Path | None, strict: bool, format_: str, verbose: bool, quiet: bool, debug: bool) -> int:
    """Recompute what the figures of a printed table must satisfy; without TABLES.toml, those of the paper.

    \b
    replay study check
    replay study check ours.toml --strict
    """
    del debug
    require_extra()
    from dataclasses import asdict
    from importlib.resources import as_file, files

    from replay.cli.main import GATE_FAILED, OK
    from replay.study.published import INCONSISTENT, check_published

    if tables is None:
        with as_file(files("replay.study").joinpath("published_example.toml")) as example:
            People(quiet=quiet, verbose=verbose).say("checking the printed tables that come with the tool")
            remarks = check_published(example)
    else:
        remarks = check_published(tables)
    if format_ == "json":
        click.echo(json.dumps([asdict(one) for one in remarks], indent=1))
    else:
        from replay.cli.study_tables import check_table

        stdout_console().print(check_table(remarks))
    return GATE_FAILED if strict and any(one.kind == INCONSISTENT for one in remarks) else OK
