"""``replay study``: what students did, and what they answered, and printed tables recomputed."""

import os
from pathlib import Path
from typing import Any

import click

from replay.cli.console import GATE_FAILED, OK, People, answer
from replay.cli.options import ANY_PATH, RUN_FOLDER, SESSION_FILE, force, reporting, tables


@click.group()
def command() -> None:
    """Join what students did with what they answered; check printed tables.

    Needs the extra `study`:  pip install "vrlab-replay[study]"
    """


def require_extra() -> None:
    """Raise ``StudyError`` with what to install where the extra `study` is not."""
    from replay.errors import StudyError

    try:
        import pandas  # noqa: F401
        import yaml  # noqa: F401
    except ImportError as error:
        raise StudyError(f'{error.name} is not installed; pip install "vrlab-replay[study]"') from error


@command.command()
@click.argument("runs", type=RUN_FOLDER, metavar="DIR")
@click.option("--out", "-o", type=ANY_PATH, required=True, metavar="DIR", help="Study folder to make.")
@click.option("--questionnaire", type=SESSION_FILE, metavar="FILE.csv", help="Answers of the students.")
@click.option("--codebook", type=SESSION_FILE, metavar="FILE.yaml", help="Items, constructs and associations.")
@click.option("--students", type=SESSION_FILE, metavar="FILE.csv", help="session,student for those without pseudonym.")
@click.option("--detector", metavar="NAME", help="Detector whose contacts count. Default: the one that misses least.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of bootstrap and permutations.")
@tables("csv")
@force
@reporting
def page(people: People, **options: Any) -> int:
    """One page over all sessions of a folder of runs, with the study where there is a questionnaire.

    \b
    replay study page class/runs --out class/page
    replay study page class/runs --questionnaire answers.csv --codebook codebook.yaml --out class/page
    """
    return write_page(people=people, **options)


def write_page(
    runs: Path,
    out: Path,
    *,
    questionnaire: Path | None,
    codebook: Path | None,
    people: People,
    students: Path | None = None,
    detector: str | None = None,
    seed: int = 0,
    force: bool = False,
    as_json: bool = False,
    tables: str = "csv",
    title: str = "Class",
    note: str = "",
) -> int:
    """Analyse runs, and answers by a codebook if there are any; write the study folder ``out``, print the tables."""
    if questionnaire is not None:
        require_extra()
    # Arrow's own pool keeps memory that it used: a class of 4,000 sessions took 340 MB with it, 260 without.
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
    from replay.cli.study_tables import study_tables
    from replay.document.file_hash import file_hash
    from replay.show.results.run_folder import check_target
    from replay.show.results.spreadsheets import require_form
    from replay.studies.class_study import folder
    from replay.studies.class_study.analysis import analyse
    from replay.studies.class_study.class_runs import read_class
    from replay.studies.class_study.codebook import read_codebook
    from replay.studies.class_study.joining import read_questionnaire

    if (questionnaire is None) != (codebook is None):
        raise click.UsageError("a questionnaire and its codebook go together; give both or none")
    require_form(tables)
    check_target(out, force=force, kind=folder.STUDY)
    study, sessions, inputs = None, read_class(runs, students), {"seed": str(seed)}
    if questionnaire is not None and codebook is not None:
        book = read_codebook(codebook)
        people.say("resampling students")
        answers = read_questionnaire(questionnaire, book)
        study = analyse(book, answers, sessions.as_metrics(), detector=detector, seed=seed)
        people.say(*(f"note: {sentence}" for sentence in study.unmatched))
        inputs |= {"questionnaire": f"sha256:{file_hash(questionnaire)}", "codebook": f"sha256:{file_hash(codebook)}"}
    folder.write_study(
        sessions, study, out, title=title, note=note, inputs=inputs, force=force, seed=seed, tables=tables
    )
    answer(
        as_json,
        folder.as_json(sessions, study),
        lambda: study_tables(study, sessions, out, seed, verbose=people.verbose),
    )
    people.say("", f"wrote {out}", f"read it:  {out / 'study.html'}")
    return OK


@command.command()
@click.argument("tables", type=SESSION_FILE, metavar="[TABLES.toml]", required=False)
@click.option("--strict", is_flag=True, help="Exit with 4 when figures contradict each other.")
@reporting
def check(tables: Path | None, strict: bool, as_json: bool, people: People) -> int:
    """Recompute what the figures of a printed table must satisfy; without TABLES.toml, those of the paper.

    \b
    replay study check
    replay study check ours.toml --strict
    """
    from dataclasses import asdict
    from importlib.resources import as_file, files

    from replay.cli.study_tables import check_table
    from replay.studies.class_study.published import INCONSISTENT, check_published

    if tables is None:
        people.say("checking the printed tables that come with the tool")
    with as_file(files("replay.studies.class_study").joinpath("published_example.toml")) as example:
        remarks = check_published(tables or example)
    answer(as_json, [asdict(remark) for remark in remarks], lambda: check_table(remarks))
    return GATE_FAILED if strict and any(remark.kind == INCONSISTENT for remark in remarks) else OK
