from importlib import import_module

import click
import pytest

from replay.cli.commands import COMMANDS, GROUPS


@pytest.mark.parametrize("name", COMMANDS)
def test_every_verb_leads_to_a_command_with_the_common_options(name):
    module, _, attribute = COMMANDS[name].entry.partition(":")
    command = getattr(import_module(module), attribute)
    assert isinstance(command, click.Command)
    for verb in command.commands.values() if isinstance(command, click.Group) else [command]:
        flags = {flag for option in verb.params for flag in option.opts}
        assert {"-v", "-q", "--debug"} <= flags, verb.name
    assert COMMANDS[name].group in GROUPS


@pytest.mark.parametrize("name", COMMANDS)
def test_one_line_of_help_fits_one_line(name):
    assert len(COMMANDS[name].help) <= 70 and COMMANDS[name].help.endswith(".")
