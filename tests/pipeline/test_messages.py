"""Options that messages, help and examples name exist: of the command that speaks, or of the program."""

import ast
import re
from collections import defaultdict
from collections.abc import Iterator

import click
import pytest
import typer.main

from cms.cli.app import app as cms_app
from floatframe.cli.app import app as floatframe_app
from tests.root import ROOT

PROGRAMS = {"cms": typer.main.get_command(cms_app), "floatframe": typer.main.get_command(floatframe_app)}
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*\w")
CALL = re.compile(r"\b(cms|floatframe) ([a-z][a-z-]+)((?: [^\s`'\"]+)*)")
FOREIGN = {"--no-deps", "--nthreads", "--install"}  # of other programs: pip, dask worker, xcode-select


def options_of(command: click.Command) -> set[str]:
    """Return the options of a command and of all below it."""
    found = {"--help"}
    for parameter in command.params:
        found |= {word for word in (*parameter.opts, *parameter.secondary_opts) if word.startswith("--")}
    for below in getattr(command, "commands", {}).values():
        found |= options_of(below)
    return found


def commands_of(program: click.Command) -> dict[str, click.Command]:
    return dict(getattr(program, "commands", {}))


#: options by (module, function) that is a command
SPEAKERS = {
    (command.callback.__module__, command.callback.__name__): options_of(command)
    for program in PROGRAMS.values()
    for command in commands_of(program).values()
    if command.callback is not None
}


def texts(path) -> Iterator[tuple[str, str, int]]:
    """Return every text in a module, the function it stands in ("" for none), and its line."""

    def walk(node: ast.AST, function: str) -> Iterator[tuple[str, str, int]]:
        for child in ast.iter_child_nodes(node):
            inside = child.name if isinstance(child, ast.FunctionDef) and not function else function
            if isinstance(child, ast.Constant) and isinstance(child.value, str):
                yield child.value, inside, child.lineno
            yield from walk(child, inside)

    yield from walk(ast.parse(path.read_text()), "")


def wrong_options(module: str, function: str, text: str) -> list[str]:
    """Return the options in a text that do not exist where it is said."""
    wrong = []
    for program, name, rest in CALL.findall(text):
        command = commands_of(PROGRAMS[program]).get(name)
        if command is not None:  # else the words are no call
            wrong += [f"{program} {name} {word}" for word in OPTION.findall(rest) if word not in options_of(command)]
    said = CALL.sub("", text)
    programs = ["floatframe"] if module.startswith("floatframe") else list(PROGRAMS)
    known = set().union(*(options_of(PROGRAMS[program]) for program in programs)) | FOREIGN
    known = SPEAKERS.get((module, function), known)
    return wrong + [word for word in OPTION.findall(said) if word not in known]


MODULES = sorted(path for package in ("fe_models", "cms", "floatframe") for path in (ROOT / package).rglob("*.py"))


@pytest.mark.parametrize("package", ["fe_models", "cms", "floatframe"])
def test_options_in_messages_exist(package):
    wrong = []
    for path in MODULES:
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        if module.split(".")[0] == package and OPTION.search(path.read_text()):
            for text, function, line in texts(path):
                wrong += [f"{path.relative_to(ROOT)}:{line}: {word}" for word in wrong_options(module, function, text)]
    assert not wrong, "\n".join(wrong)


def test_commands_are_known_by_their_functions():
    """The check looks at what a command says with the options of that command."""
    assert ("floatframe.cli.analyses", "modes_command") in SPEAKERS
    assert sum(module.startswith("cms") for module, _ in SPEAKERS) > 5


@pytest.mark.parametrize(
    ("module", "function", "text", "n"),
    [
        ("floatframe.cli.analyses", "modes_command", "5 more modes (--modes)", 0),
        ("floatframe.cli.analyses", "static_command", "5 more modes (--modes)", 1),
        ("floatframe.results.recovery", "", "use --no-such-thing", 1),
        ("cms.jobs.job", "", "Example: floatframe modes a.toml --animate 1 --to buckens", 1),
        ("cms.jobs.job", "", "a -- b, and ---- or x--y", 0),
    ],
)
def test_the_check_sees_what_is_wrong(module, function, text, n):
    assert len(wrong_options(module, function, text)) == n


PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])


def test_calls_on_pages_name_commands_and_options_that_exist():
    wrong = []
    for page in PAGES:
        for line in page.read_text().splitlines():
            for program, name, rest in CALL.findall(line.split(" #")[0]):
                command = commands_of(PROGRAMS[program]).get(name)
                if command is not None:
                    wrong += [f"{page.name}: {program} {name} {word}" for word in OPTION.findall(rest)
                              if word not in options_of(command)]  # fmt: skip
    assert not wrong, "\n".join(wrong)


ALWAYS = {"--output": "-o", "--workers": "-j"}  #: short forms that these options have in every command


def test_a_short_option_has_one_meaning_in_both_programs():
    meanings = defaultdict(set)
    for program in PROGRAMS.values():
        for command in commands_of(program).values():
            for parameter in command.params:
                long = next((word for word in parameter.opts if word.startswith("--")), "")
                if long in ALWAYS:
                    assert ALWAYS[long] in parameter.opts, f"{command.name} {long}"
                for word in parameter.opts:
                    if word.startswith("-") and not word.startswith("--"):
                        meanings[word].add(long)
    assert {word: long for word, long in meanings.items() if len(long) > 1} == {}
    assert {"-o", "-j"} <= set(meanings)
