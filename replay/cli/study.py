"""``replay study``: what students did beside what they answered, and printed tables recomputed."""

from pathlib import Path
from typing import Any

import click

from replay.cli.console import GATE_FAILED, OK, People, answer, print_name
from replay.cli.options import ANY_PATH, RUN_FOLDER, SESSION_FILE, common, force, reporting


@click.group()
def command() -> None:
    """Join what students did with what they answered; check printed tables.

    Needs the extra `study`:  pip install "vrlab-replay[study]"
    """


def require_extra() -> None:
    """Raise ``StudyError`` with what to install where the extra `study` is not."""
    from replay.errors import StudyError

    try:
        import statsmodels  # noqa: F401
        import yaml  # noqa: F401
    except ImportError as error:
        raise StudyError(f'{error.name} is not installed; pip install "vrlab-replay[study]"') from error


@command.command()
@click.argument("runs", type=RUN_FOLDER, nargs=-1, required=True)
@click.option("--out", "-o", type=ANY_PATH, required=True, metavar="FILE.parquet", help="Table to write.")
@click.option("--students", type=SESSION_FILE, metavar="FILE.csv", help="session,student for those without pseudonym.")
@force
@common
def collect(runs: tuple[Path, ...], out: Path, students: Path | None, force: bool, people: People) -> int:
    """Join the metrics of run folders, or of folders of them, into one table.

    \b
    replay study collect class/runs --out class/metrics.parquet
    """
    from replay.studies.class_study import collecting

    table = collecting.collect(runs, students)
    collecting.write_table(table, out, force=force)
    people.say(f"{len(table)} rows of {len(set(table['student'].to_pylist()))} students")
    print_name(out)
    return OK


@command.command()
@click.argument("metrics", type=SESSION_FILE, metavar="METRICS.parquet")
@click.argument("questionnaire", type=SESSION_FILE, metavar="QUESTIONNAIRE.csv")
@click.option("--codebook", type=SESSION_FILE, required=True, metavar="FILE.yaml", help="What is asked of which items.")
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help="Study folder to make: page, tables, JSON.")
@click.option("--detector", metavar="NAME", help="Whose contacts count. Default: the one that misses least.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of bootstrap and permutations.")
@force
@reporting
def analyse(metrics: Path, questionnaire: Path, codebook: Path, people: People, **asked: Any) -> int:
    """Reliability of the questionnaire and the associations its codebook asks about.

    \b
    replay study analyse metrics.parquet answers.csv --codebook codebook.yaml --out study1
    """
    return analyse_files({"metrics": metrics, "questionnaire": questionnaire, "codebook": codebook}, people, **asked)


@command.command()
@click.argument("runs", type=RUN_FOLDER, metavar="DIR")
@click.option("--out", "-o", type=ANY_PATH, required=True, metavar="DIR", help="Study folder to make.")
@click.option("--questionnaire", type=SESSION_FILE, metavar="FILE.csv", help="Answers of the students.")
@click.option("--codebook", type=SESSION_FILE, metavar="FILE.yaml", help="What is asked of which items.")
@click.option("--students", type=SESSION_FILE, metavar="FILE.csv", help="session,student for those without pseudonym.")
@click.option("--detector", metavar="NAME", help="Whose contacts count. Default: the one that misses least.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of bootstrap and permutations.")
@force
@reporting
def page(runs: Path, questionnaire: Path | None, codebook: Path | None, people: People, **asked: Any) -> int:
    """One page over all sessions of a folder of runs, with the study where there is a questionnaire.

    \b
    replay study page class/runs --out class/page
    """
    if (questionnaire is None) != (codebook is None):
        raise click.UsageError("a questionnaire and its codebook go together; give both or none")
    inputs = {} if questionnaire is None or codebook is None else {"questionnaire": questionnaire, "codebook": codebook}
    return analyse_files(inputs, people, title="Class", runs=runs, **asked)


def analyse_files(
    inputs: dict[str, Path], people: People, *, title: str = "Study", seed: int, force: bool, out: Path | None = None,
    detector: str | None = None, as_json: bool = False, runs: Path | None = None, students: Path | None = None,
) -> int:  # fmt: skip
    """Analyse runs, and questionnaire and codebook if there are any; write the study folder ``out``, print the tables.

    The metrics are those of ``inputs``, or else of the runs.
    """
    if "codebook" in inputs:
        require_extra()
    from replay.cli.study_tables import study_tables
    from replay.studies.class_study import folder
    from replay.studies.class_study.analysis import analyse as work
    from replay.studies.class_study.class_runs import read_class
    from replay.studies.class_study.codebook import read_codebook
    from replay.studies.class_study.joining import read_metrics, read_questionnaire

    if out is not None:
        folder.check_study_target(out, force=force)
    study, every = None, None if runs is None else read_class(runs, students)
    if "codebook" in inputs:
        book = read_codebook(inputs["codebook"])
        people.say("resampling students")
        answers = read_questionnaire(inputs["questionnaire"], book)
        metrics = read_metrics(inputs["metrics"]) if every is None else every.as_metrics()
        study = work(book, answers, metrics, detector=detector, seed=seed)
    if out is not None:
        from replay.base.file_hash import file_hash

        given = {name: f"sha256:{file_hash(path)}" for name, path in inputs.items()} | {"seed": str(seed)}
        folder.write_study(study, out, title=title, inputs=given, force=force, runs=every, seed=seed)
    told = {"sessions": len(every.metrics)} if every is not None else {}
    if study is not None:
        told |= folder.as_json(study)
    answer(as_json, told, lambda: study_tables(study, every))
    if out is not None:
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
    require_extra()
    from dataclasses import asdict
    from importlib.resources import as_file, files

    from replay.cli.study_tables import check_table
    from replay.studies.class_study.published import INCONSISTENT, check_published

    if tables is None:
        people.say("checking the printed tables that come with the tool")
    with as_file(files("replay.studies.class_study").joinpath("published_example.toml")) as example:
        remarks = check_published(tables or example)
    answer(as_json, [asdict(one) for one in remarks], lambda: check_table(remarks))
    return GATE_FAILED if strict and any(one.kind == INCONSISTENT for one in remarks) else OK
