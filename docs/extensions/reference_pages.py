"""Reference pages, made from the programs: commands, keys and contents of files, checks, fields of decks."""

import json
import re
from collections.abc import Iterator
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

import typer.main
from copied_pages import put
from sphinx.application import Sphinx

import cms.cli.app
import cms.cli.exchange
import floatframe.cli.app
from cms.assessment.quality.limits import LIMITS
from cms.body.modal_file.schema import ENTRIES, GROUPS, dataset_of
from fe_models.files.field_pages import field_tables
from fe_models.foundation.file_kinds import KINDS
from fe_models.foundation.parametric_file import REPEAT, schema_text
from fe_models.foundation.units import Units
from floatframe.engine.kernels.memory import Rows
from floatframe.results.results_file import DATASETS

NOTHING = (None, "", [], {})  #: defaults that a page leaves blank
OTHER = "Tables within others"  #: heading of the tables that several others hold
PROGRAMS = {"cms": cms.cli.app.app, "floatframe": floatframe.cli.app.app}


def write_pages(app: Sphinx) -> None:
    """Write the pages into the folder reference of the sources; remove old pages."""
    folder = Path(app.srcdir) / "reference"
    folder.mkdir(exist_ok=True)
    pages = {f"{name}-commands.md": commands_page(name) for name in PROGRAMS}
    pages |= {f"{kind}-file.md": keys_page(kind) for kind in KINDS}
    pages |= {"modal-file.md": modal_file_page(), "results-file.md": results_file_page()}
    pages |= {"check-records.md": checks_page()}
    pages |= {"deck-fields.md": fields_page(), "formats.md": formats_page()}
    for old in folder.glob("*.md"):
        if old.name not in pages:
            old.unlink()
    for name, text in pages.items():
        put(text, folder / name)


# commands --------------------------------------------------------------------------------------------------------


def commands_page(program: str) -> str:
    """Return the page of the commands of a program, in its groups."""
    lines = [f"# Commands of {program}", "", f"`{program} COMMAND --help` prints the same.", ""]
    last = None
    for name, command in typer.main.get_command(PROGRAMS[program]).commands.items():  # type: ignore[attr-defined]
        if command.rich_help_panel != last:
            last = command.rich_help_panel
            lines += [f"## {last}", ""]
        lines += [f"### {program} {name}", "", *description(command.help or ""), *parameters_table(command.params), ""]
    return "\n".join(lines)


def description(text: str) -> list[str]:
    """Return the help of a command: its paragraphs, then its examples as one block."""
    paragraphs = [part.replace("\\[", "[") for part in re.split(r"\n\s*\n", text.strip())]
    examples = [part.removeprefix("Example:").strip() for part in paragraphs if part.startswith("Example:")]
    lines: list[str] = []
    for part in paragraphs:
        if not part.startswith("Example:"):
            lines += [literal(part), ""]
    return [*lines, "```sh", *examples, "```", ""] if examples else lines


def parameters_table(parameters: list[Any]) -> list[str]:
    """Return the arguments and options of a command as a table."""
    rows = []
    for each in parameters:
        if each.hidden or each.name == "help":
            continue
        is_option = each.opts[0].startswith("-")
        name = ", ".join(f"`{word}`" for word in (*each.opts, *each.secondary_opts)) if is_option else (
            f"`{each.metavar or each.name.upper()}`"
        )  # fmt: skip
        default = each.default if isinstance(each.default, str | int | float) and each.default is not False else ""
        rows.append((name, literal((each.help or "").replace("\\[", "[")), f"`{default}`" if default != "" else ""))
    return table(("argument or option", "meaning", "default"), rows)


# keys ------------------------------------------------------------------------------------------------------------

EXAMPLES = Path(__file__).with_name("examples.toml")


def keys_page(kind: str) -> str:
    """Return the page of the keys of a kind of file: the file, then its tables, those of one place together."""
    schema = json.loads(schema_text(kind))
    lines = [
        f"# Keys of {'an' if kind == 'optimization' else 'a'} {kind} file", "",
        f"`kind = \"{kind}\"`; `{KINDS[kind].command} FILE` runs it, and `floatframe schema {kind}` prints its schema. "
        "A key without a default is required where its table is given, unless its meaning says otherwise.", "",
    ]  # fmt: skip
    if KINDS[kind].is_parametric:
        lines += ["Every table but the file itself may have `repeat`: " + literal(REPEAT) + ".", ""]
    lines += ["## The file", "", *keys_table(schema), ""]
    for place, sections in groupby(sections_of(schema), key=lambda section: section[0]):
        lines += [f"## {literal(place)}", ""]
        for _, name, meaning, rows in sections:
            lines += [f"### {name}", ""] if name else []
            lines += [literal(meaning[:1].upper() + meaning[1:]), "", *rows, ""]
            if example := examples().get((table_of(place), name)):
                lines += ["```toml", example, "```", ""]
    return "\n".join(lines)


@cache
def examples() -> dict[tuple[str, str], str]:
    """Return the text of the example of each type of table, by the table and the type."""
    texts = [text.strip() for text in EXAMPLES.read_text(encoding="utf-8").split("\n\n")]
    return {
        (table_of(text), re.search(r'^type = "(.+)"', text, re.MULTILINE)[1]): text for text in texts if text[0] == "["
    }


def table_of(place: str) -> str:
    """Return which table a heading names: "joints" for [joints.NAME], "motions" for a function, "scene" for a shape."""
    heads = re.findall(r"\[([\w.]+)\]", place.partition("\n")[0])
    head = heads[-1].split(".") if heads else [place]
    return "motions" if "motions" in head else head[0]


def sections_of(schema: dict[str, Any]) -> list[tuple[str, str, str, list[str]]]:
    """Return place, type, meaning and rows of each table of a file, in the order of the keys of the file."""
    order = [*schema["properties"], OTHER]
    found = []
    for definition in schema.get("$defs", {}).values():
        if rows := definition.get("properties") and keys_table(definition):
            meaning = definition.get("description", "")
            where, _, rest = meaning.partition(": ") if meaning.startswith("[") else (OTHER, "", meaning)
            place, _, name = where.rstrip(".").partition(" of type ")
            name = name.strip('"') if meaning.startswith("[") else re.sub("(Section|Table)$", "", definition["title"])
            found.append((place, name, rest, rows))

    def rank(section: tuple[str, str, str, list[str]]) -> tuple[int, str, str]:
        """Return the rank of a table: by the key of the file that holds it, its path, its type."""
        path = section[0].strip("[").split("]")[0]
        return order.index(OTHER if section[0] == OTHER else path.split(".")[0]), path, section[1]

    return sorted(found, key=rank)


def keys_table(definition: dict[str, Any]) -> list[str]:
    """Return the keys of a table of a file, with their meanings and defaults; `repeat` is a key of every table."""
    rows = []
    for key, value in definition["properties"].items():
        found = [value, *value.get("anyOf", ())]
        given = [each["default"] for each in found if each.get("default") not in NOTHING]
        defaults = [json.dumps(default, ensure_ascii=False) for default in given]
        meaning = next((each["description"] for each in found if "description" in each), "")
        if meaning != REPEAT:
            default = f"`{defaults[0]}`" if defaults and len(defaults[0]) < 60 else ""
            rows.append((f"`{key}`", literal(meaning), default))
    return table(("key", "meaning", "default"), rows)


# HDF5 files ------------------------------------------------------------------------------------------------------

#: dimensions in place of the units of a unit system
DIMENSIONS = Units("", 1.0, 1.0, 1.0, "length", "mass", "time", "", "")
KINDS_OF_VALUES = {str: "text", int: "integer", bool: "integer", float: "float"}
#: sizes of a results file under the names that its page explains
SIZES = {"n_c": "n_joints", "angles": "n_angles", "loads": "n_loads", "body loads": "n_load_cases"}


def modal_file_page() -> str:
    """Return the page of the groups of a modal file, with their attributes and datasets."""
    lines = [
        "# Content of a modal file", "",
        "[The modal file](../modal_file.md) explains sizes, symbols and storage.", "",
    ]  # fmt: skip
    for group, layout in GROUPS.items():
        attributes = [
            (f"`{name}`", KINDS_OF_VALUES[kind], literal(meaning))
            for name, (kind, meaning) in layout.attributes.items()
        ]
        datasets = [
            (f"`{name}`", entry.shape, dataset_of(path, (), DIMENSIONS).unit, literal(entry.description))
            for path, entry in ENTRIES.items()
            if (name := path.removeprefix(f"{group.rstrip('/')}/")) != path and "/" not in name
        ]
        lines += [f"## `{group}`", "", literal(layout.meaning), ""]
        lines += [*table(("attribute", "type", "meaning"), attributes), ""] if attributes else []
        lines += [*table(("dataset", "shape", "unit", "meaning"), datasets), ""] if datasets else []
    return "\n".join(lines)


def results_file_page() -> str:
    """Return the page of the datasets of a results file."""
    rows = []
    for name, (field, meaning) in DATASETS.items():
        declared = Rows()._asdict()[field]
        shape = ", ".join(SIZES.get(str(size), str(size)) for size in declared.shape)
        rows.append((f"`{name}`", f"({shape})", declared.unit, literal(meaning)))
    lines = [
        "# Datasets of a results file", "",
        "[The results file](../results_file.md) explains sizes and axes.", "",
        *table(("dataset", "shape", "unit in m-kg-s", "meaning"), rows), "",
    ]  # fmt: skip
    return "\n".join(lines)


# checks --------------------------------------------------------------------------------------------------------


def checks_page() -> str:
    """Return the page of all records of checks, with their limits and remedies."""
    rows = [
        (
            f"`{name}`",
            literal(limit.title),
            limit_cell(limit.tolerance),
            limit_cell(limit.failing),
            literal(limit.action),
        )
        for name, limit in LIMITS.items()
    ]
    lines = [
        "# Records of checks", "",
        "[How good is my reduced body?](../quality.md) says which command gives which record.", "",
        *table(("record", "value", "passes up to", "fails above", "if it does not pass"), rows), "",
    ]  # fmt: skip
    return "\n".join(lines)


def limit_cell(limit: float | None) -> str:
    """Return a limit as a cell of a table."""
    return "–" if limit is None else f"{limit:.7g}"


# decks ---------------------------------------------------------------------------------------------------------


def fields_page() -> str:
    """Return the page of all cards, keywords and commands of decks, with their fields."""
    lines = [
        "# Fields of decks",
        "",
        "These tables drive the readers. [Decks](../deck_fields.md) says what the body has of each card. Repeated "
        "fields, further fields that are read or left out together, data lines and the numbers in a block are not "
        "listed one by one.",
        "",
        field_tables(),
        "",
    ]
    return "\n".join(lines)


# formats -------------------------------------------------------------------------------------------------------


def formats_page() -> str:
    """Return the page of all formats, one table for what comes in and one for what goes out."""
    lines = [
        "# All formats",
        "",
        "`cms formats` prints the same tables. [Formats](../formats.md) says how to use them.",
        "",
    ]
    return "\n".join([*lines, cms.cli.exchange.markdown_tables(), ""])


# text ------------------------------------------------------------------------------------------------------------


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    """Return the lines of a table, none if it has no rows."""
    lines = [head, ("---",) * len(head), *rows] if rows else []
    return [f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in lines]


def literal(text: str) -> str:
    """Return plain text so that MyST shows it as it is written; words in backticks are code, names of pages links."""
    parts = re.split(r"(docs/\w+\.md|`[^`]+`)", re.sub(r"\s+", " ", text))
    return "".join(shown(parts))


def shown(parts: list[str]) -> Iterator[str]:
    """Yield text with escaped marks; at the odd places code, and links for the names of pages."""
    for k, part in enumerate(parts):
        if k % 2:
            page = part.removeprefix("docs/")
            yield part if part.startswith("`") else f"[{page.removesuffix('.md')}](../{page})"
        else:
            yield re.sub(r"([\\`*_{}<>\[\]#$])", r"\\\1", part)


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the pages before Sphinx looks for its sources."""
    app.connect("builder-inited", write_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
