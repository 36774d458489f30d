"""Tables of the fields of all programs in Markdown, for the reference pages of the documentation."""

from fe_models.files.abaqus.keywords import PARAMETERS, parameters_of
from fe_models.files.ansys.command_fields import COLUMNS, COMMANDS, fields_of_command
from fe_models.files.decks.field_table import TableField, markdown_table, parse_fields
from fe_models.files.nastran.deck.card_fields import CARDS, fields_of

__all__ = ["field_tables"]


def field_tables() -> str:
    """Return a section for each program: every supported card, keyword or command, and its fields."""
    abaqus = {f"*{name}": parameters_of(name) for name in sorted(PARAMETERS)}
    ansys = {name: fields_of_command(name) for name in sorted(COMMANDS)}
    ansys["EBLOCK, columns"] = parse_fields(COLUMNS.split())
    nastran = {name: _with_rest(name) for name in sorted(CARDS)}
    sections = [
        ("Nastran", "card", nastran),
        ("Abaqus and CalculiX", "keyword", abaqus),
        ("ANSYS", "command", ansys),
    ]
    return "\n\n".join(f"## {title}\n\n{markdown_table(what, fields)}" for title, what, fields in sections)


def _with_rest(name: str) -> tuple[TableField, ...]:
    """Return the fields of a Nastran card, with a description of the remaining fields."""
    fields, last = fields_of(name), CARDS[name].split()[-1]
    if not last.startswith("..."):
        return fields
    use = "left out" if last.endswith("^") else "read"
    return (*fields, TableField(0, "further fields" if fields else "all fields", use))
