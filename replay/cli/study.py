"""``replay study``: what students did, and what they answered, and printed tables recomputed."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import EXIT_GATE_FAILED, EXIT_OK, People, answer
from replay.cli.options import ANY_PATH, RUN_FOLDER, SESSION_FILE, force, reporting, tables

if TYPE_CHECKING:
    from replay.studies.class_study.analysis import Study
    from replay.studies.class_study.class_runs import ClassRuns
    from replay.studies.class_study.page import Heading


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
def page(people: People, out: Path, tables: str, force: bool, as_json: bool, **inputs: Any) -> int:
    """One page over all sessions of a folder of runs, with the study where there is a questionnaire.

    \b
    replay study page class/runs --out class/page
    replay study page class/runs --questionnaire answers.csv --codebook codebook.yaml --out class/page
    """
    return write_page(PageRequest(**inputs), out, people=people, force=force, as_json=as_json, tables=tables)


@dataclass(frozen=True)
class PageRequest:
    """The inputs of a page: runs, answers with their codebook if there are any, and how they are analysed."""

    runs: Path
    questionnaire: Path | None
    codebook: Path | None
    students: Path | None = None
    detector: str | None = None
    seed: int = 0


def write_page(
    request: PageRequest,
    out: Path,
    *,
    people: People,
    heading: "Heading | None" = None,
    force: bool = False,
    as_json: bool = False,
    tables: str = "csv",
) -> int:
    """Analyse what is requested; write the study folder ``out``, print the tables."""
    if (request.questionnaire is None) != (request.codebook is None):
        raise click.UsageError("a questionnaire and its codebook go together; give both or none")
    if request.questionnaire is not None:
        require_extra()
    # Arrow's own pool keeps memory that it used: a class of 4,000 sessions took 340 MB with it, 260 without.
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
    from replay.cli.study_tables import study_tables
    from replay.show.results.run_folder import check_target
    from replay.show.results.spreadsheets import require_form
    from replay.studies.class_study import folder
    from replay.studies.class_study.class_runs import read_class
    from replay.studies.class_study.page import Heading

    require_form(tables)
    check_target(out, force=force, kind=folder.STUDY_FOLDER)
    sessions = read_class(request.runs, request.students)
    study = _study_of_answers(request, sessions, people)
    folder.write_study(
        sessions,
        study,
        out,
        heading=heading or Heading(),
        inputs=_inputs(request),
        force=force,
        seed=request.seed,
        tables=tables,
    )
    answer(
        as_json,
        folder.as_json(sessions, study),
        lambda: study_tables(study, sessions, out, request.seed, verbose=people.verbose),
    )
    people.say("", f"wrote {out}", f"read it:  {out / 'study.html'}")
    return EXIT_OK


def _study_of_answers(request: PageRequest, sessions: "ClassRuns", people: People) -> "Study | None":
    """The study of the answers; ``None``: there is no questionnaire."""
    from replay.studies.class_study.analysis import analyse
    from replay.studies.class_study.codebook import read_codebook
    from replay.studies.class_study.joining import read_questionnaire

    if request.questionnaire is None or request.codebook is None:
        return None
    codebook = read_codebook(request.codebook)
    people.say("resampling students")
    answers = read_questionnaire(request.questionnaire, codebook)
    study = analyse(codebook, answers, sessions.as_metrics(), detector=request.detector, seed=request.seed)
    people.say(*(f"note: {sentence}" for sentence in study.unmatched))
    return study


def _inputs(request: PageRequest) -> dict[str, str]:
    """The seed, and digests of the files of answers."""
    from replay.document.file_hash import file_hash

    files = {"questionnaire": request.questionnaire, "codebook": request.codebook}
    digest_of_file = {name: f"sha256:{file_hash(file)}" for name, file in files.items() if file is not None}
    return {"seed": str(request.seed)} | digest_of_file


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
    from replay.studies.class_study.published import KIND_INCONSISTENT, check_published

    if tables is None:
        people.say("checking the printed tables that come with the tool")
    with as_file(files("replay.studies.class_study").joinpath("published_example.toml")) as example:
        remarks = check_published(tables or example)
    answer(as_json, [asdict(remark) for remark in remarks], lambda: check_table(remarks))
    return EXIT_GATE_FAILED if strict and any(remark.kind == KIND_INCONSISTENT for remark in remarks) else EXIT_OK
