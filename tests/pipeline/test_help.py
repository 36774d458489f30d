"""The help of every command is printed as it is written."""

import re

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from cms.cli.app import app as cms_app
from floatframe.cli.app import app as floatframe_app

COMMANDS = {
    f"{program} {name}": (app, name, command)
    for program, app in (("cms", cms_app), ("floatframe", floatframe_app))
    for name, command in get_command(app).commands.items()
}


@pytest.mark.parametrize("words", COMMANDS)
def test_words_in_brackets_are_not_lost(words):
    app, name, command = COMMANDS[words]
    written = [command.callback.__doc__ or "", *(getattr(each, "help", "") or "" for each in command.params)]
    shown = "".join(re.sub(r"[│\s]", "", line) for line in CliRunner().invoke(app, [name, "--help"]).output.split("\n"))
    for text in written:
        for found in re.findall(r"\[[a-z][^\]\n]*\]", text):
            assert re.sub(r"\s", "", found) in shown, f"{found} is not in the help of {words}"
