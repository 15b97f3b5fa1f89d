"""The check of printed tables in a terminal: its headline, and the exit code of a script that asks for it."""

import io

import pytest
from rich.console import Console

from replay.cli.main import main
from replay.cli.study_tables import check_table
from replay.studies.class_study.published import KIND_AGREES, KIND_INCONSISTENT, KIND_WEAK, Remark


def remarks_of(*kinds):
    """A remark of each kind, about a row that is called after it."""
    return [Remark(kind, "table 1", f"row of {kind}", "message") for kind in kinds]


@pytest.mark.parametrize(
    ("kinds", "headline"),
    [
        ((KIND_AGREES, KIND_INCONSISTENT, KIND_WEAK), "1 of 3 checks contradict the print"),
        ((KIND_AGREES, KIND_WEAK, KIND_WEAK), "every printed figure agrees"),
    ],
    ids=["a contradiction", "no contradiction"],
)
def test_check_table_counts_contradictions_and_lists_them_first(kinds, headline):
    """Figures that a publication printed are checked; ``kinds``: of the remarks on its rows, in the order of the rows.

    In the table contradictions come first, then what is weak, and last what agrees.
    """
    stream = io.StringIO()
    Console(file=stream, width=120).print(check_table(remarks_of(*kinds)))
    lines = [line.strip() for line in stream.getvalue().splitlines() if line.strip()]
    assert lines[0] == headline
    rows = [line.split()[0] for line in lines if "row of" in line]
    assert rows == sorted(kinds, key=[KIND_INCONSISTENT, KIND_WEAK, KIND_AGREES].index)


@pytest.mark.parametrize(
    ("options", "kind", "code"),
    [
        (["--strict"], KIND_INCONSISTENT, 4),
        ([], KIND_INCONSISTENT, 0),
        (["--strict"], KIND_WEAK, 0),
    ],
    ids=["strict, a contradiction", "a contradiction", "strict, a weak remark"],
)
def test_only_a_strict_check_fails_at_a_contradiction(options, kind, code, monkeypatch, capsys):
    """The check of printed figures has one remark of a ``kind``; ``code``: the exit code.

    It reads the tables that come with the tool, as no others are named, and says so.
    """
    monkeypatch.setattr("replay.studies.class_study.published.check_published", lambda path: remarks_of(kind))
    assert main(["study", "check", *options]) == code
    assert "checking the printed tables that come with the tool" in capsys.readouterr().err


def test_check_reads_the_named_tables_before_the_example(tmp_path, monkeypatch):
    """`replay study check FILE` reads that file; without a file it reads the example that comes with the tool."""
    paths = []
    monkeypatch.setattr("replay.studies.class_study.published.check_published", lambda path: paths.append(path) or [])
    own = tmp_path / "ours.toml"
    own.touch()
    assert main(["study", "check", str(own)]) == main(["study", "check"]) == 0
    assert [path.name for path in paths] == ["ours.toml", "published_example.toml"]
