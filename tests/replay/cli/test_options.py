import sys

import click
from click.testing import CliRunner

from replay.cli.commands import COMMANDS
from replay.cli.main import cli
from replay.cli.options import let_modules_here_be_found, reporting, window


@click.command()
@window
@reporting
def command(people, **given):
    click.echo(repr({**given, **vars(people)}))


def test_options_mean_the_same_on_every_verb():
    got = CliRunner().invoke(command, ["--start", "1", "--end", "2.5", "--format", "json", "-v", "-q", "--debug"])
    assert eval(got.output) == {"start": 1.0, "end": 2.5, "as_json": True, "quiet": True, "verbose": True}


def test_the_tolerance_of_the_command_line_is_that_of_python():
    from replay.cli.options import tau
    from replay.comparison.tolerance import TAU

    @click.command()
    @tau
    def asked(tau):
        click.echo(tau)

    assert float(CliRunner().invoke(asked, []).output) == TAU


def test_modules_of_the_current_folder_are_found_only_for_a_detector_that_names_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", [path for path in sys.path if path])
    let_modules_here_be_found(["hybrid", ""])
    assert str(tmp_path) not in sys.path
    let_modules_here_be_found(["mine=engine:Detector"])
    let_modules_here_be_found(["mine=engine:Detector"])
    assert sys.path.count(str(tmp_path)) == 1 and sys.path[-1] == str(tmp_path)


def options_of(verb):
    found = cli.get_command(click.Context(cli), verb).params
    return {flag: option for option in found for flag in option.opts if flag.startswith("--")}


def test_no_help_names_a_limit_that_is_none():
    assert [verb for verb in COMMANDS if "None" in CliRunner().invoke(cli, [verb, "--help"]).output] == []


def test_every_verb_that_reports_takes_a_format():
    silent = {"guide", "mesh", "scene", "share", "study", "view"}
    assert {verb for verb in COMMANDS if "--format" not in options_of(verb)} == silent
