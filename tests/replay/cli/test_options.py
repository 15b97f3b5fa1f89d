import sys

import click
from click.testing import CliRunner

from cdcore.tolerances import TWO_MICROMETRES
from replay.cli.options import import_from_current_folder, replaying, reporting


@click.command()
@replaying
@reporting
def command(people, **given):
    """Print all that a command gets."""
    click.echo(repr({**given, **vars(people)}))


def test_options_mean_the_same_on_every_verb():
    """A command that takes them all prints what it was given, and the defaults of what it was not."""
    actual = CliRunner().invoke(command, ["--start", "1", "--end", "2.5", "--format", "json", "-v", "-q", "--debug"])
    reported = {
        "start": 1.0,
        "end": 2.5,
        "as_json": True,
        "quiet": True,
        "verbose": True,
        "tau": TWO_MICROMETRES,
        "scene": None,
    }
    assert eval(actual.output) == reported | {"force": False, "pairs": None, "policy": (), "no_picture": False}


def test_current_folder_modules_load_only_for_a_named_detector(tmp_path, monkeypatch):
    """``module:Class`` names one; the folder comes last, and once."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", [path for path in sys.path if path])
    import_from_current_folder(["hybrid", ""])
    assert str(tmp_path) not in sys.path
    import_from_current_folder(["mine=engine:Detector"])
    import_from_current_folder(["mine=engine:Detector"])
    assert sys.path.count(str(tmp_path)) == 1 and sys.path[-1] == str(tmp_path)
