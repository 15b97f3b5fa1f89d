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
    """Verbs share their options by decorators; a command with all of them prints the values that it gets.

    They are those of the call, and defaults of the options that are not in it.
    """
    options = ["--start", "1", "--end", "2.5", "--format", "json", "-v", "-q", "--debug"]
    printed = CliRunner().invoke(command, options).output
    of_the_call = {"start": 1.0, "end": 2.5, "as_json": True, "quiet": True, "verbose": True}
    defaults = {
        "tau": TWO_MICROMETRES, "scene": None, "force": False, "pairs": None, "policy": (), "no_picture": False,
    }  # fmt: skip
    assert eval(printed) == of_the_call | defaults


def test_current_folder_modules_load_only_for_a_named_detector(tmp_path, monkeypatch):
    """``mine=engine:Detector`` names a class of a module, which may be in the current folder; ``hybrid`` is built in.

    "" is no detector (`replay shrink` without a label). For the first the folder is added to Python's path: last, and
    once, though it is called for twice. Empty entries mean the current folder already, so they are removed before.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", [path for path in sys.path if path])
    import_from_current_folder(["hybrid", ""])
    assert str(tmp_path) not in sys.path
    import_from_current_folder(["mine=engine:Detector"])
    import_from_current_folder(["mine=engine:Detector"])
    assert sys.path.count(str(tmp_path)) == 1 and sys.path[-1] == str(tmp_path)
