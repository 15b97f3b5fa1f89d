"""``replay study collect|demo``: from run folders to one table of metrics, and a whole synthetic class."""

from pathlib import Path

import click

from replay.cli.console import DATA_LOSS, OK, People, counting, print_name
from replay.cli.options import ANY_PATH, RUN_FOLDER, SESSION_FILE, common, force, jobs

SLOW = "22.5Hz=discrete[rate_hz=22.5]"
"""The detector whose misses the synthetic class is analysed with besides the oracle."""


def require_extra() -> None:
    """Raise ``StudyError`` with what to install where the extra `study` is not."""
    from replay.errors import StudyError

    try:
        import statsmodels  # noqa: F401
        import yaml  # noqa: F401
    except ImportError as error:
        raise StudyError(f'{error.name} is not installed; pip install -e ".[study]"') from error


@click.command()
@click.argument("runs", type=RUN_FOLDER, nargs=-1, required=True)
@click.option("--out", "-o", type=ANY_PATH, required=True, metavar="FILE.parquet", help="Table to write.")
@click.option("--students", type=SESSION_FILE, metavar="FILE.csv", help="session,student for those without pseudonym.")
@force
@common
def collect_runs(runs: tuple[Path, ...], out: Path, students: Path | None, force: bool, people: People) -> int:
    """Join the metrics of run folders, or of folders of them, into one table.

    \b
    replay study collect class/runs --out class/metrics.parquet
    """
    from replay.studies.class_study.collecting import collect, write_table

    table = collect(runs, students)
    write_table(table, out, force=force)
    people.say(f"{len(table)} rows of {len(set(table['student'].to_pylist()))} students")
    print_name(out)
    return OK


@click.command()
@click.option("--out", "-o", type=ANY_PATH, default="class", show_default=True, metavar="DIR", help="Folder to make.")
@click.option("--students", type=click.IntRange(min=5, max=999), default=52, show_default=True, help="How many.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of the class.")
@jobs
@common
def demo_class(out: Path, students: int, seed: int, jobs: int, people: People) -> int:
    """Make up a class, replay its sessions, analyse it: the whole way from recordings to the page, in one folder.

    \b
    replay study demo --jobs 2
    """
    require_extra()
    from replay.cli.study import analyse_files
    from replay.studies.class_study.collecting import collect, write_table
    from replay.studies.class_study.synthetic_class import ANSWERS, CODEBOOK, SESSIONS, make_class

    people.say(f"making up {students} students and recording their sessions ...")
    failed = make_class(out, students=students, seed=seed, jobs=jobs, on_done=counting(people, students))
    files = sorted((out / SESSIONS).glob("*.mcap"))
    people.say(f"replaying {len(files)} sessions ...")
    from replay.api.batch import run_batch

    settings = {"detectors": SLOW, "oracle": None, "seed": 0, "picture": False}
    batch = run_batch(files, out / "runs", jobs=jobs, settings=settings, on_done=counting(people, len(files)))
    write_table(collect([out / "runs"]), out / "metrics.parquet", force=True)
    inputs = {"questionnaire": out / ANSWERS, "codebook": out / CODEBOOK}
    title, study = "A class that was made up", out / "study"
    analyse_files(inputs, people, runs=out / "runs", out=study, title=title, seed=seed, force=True)
    return DATA_LOSS if failed or batch.failed else OK
