"""The blocks of an Abaqus or CalculiX deck that make its mesh, and the keywords that cannot be read truthfully."""

from collections.abc import Iterator
from dataclasses import dataclass

from fe_models.errors import MeshError

__all__ = ["DeckBlock", "mesh_blocks"]

_REFUSED = {
    "INCLUDE": "put the included text into this file",
    "SYSTEM": "write the nodes in global coordinates",
    "NGEN": "write the generated nodes out",
    "NFILL": "write the generated nodes out",
    "NCOPY": "write the copied nodes out",
    "NMAP": "write the mapped nodes out",
    "ELGEN": "write the generated elements out",
    "ELCOPY": "write the copied elements out",
    "REFLECTION": "write the elements out",
    "MANIFEST": "write one input file without references to others",
}  # keyword -> what to do; each makes or moves nodes or elements


@dataclass(frozen=True)
class DeckBlock:
    """A keyword line with its parameters and the data lines below it."""

    keyword: str
    parameters: dict[str, str]  #: upper-case names; "" for a parameter without value
    lines: list[str]
    line_number: int

    @property
    def words(self) -> list[str]:
        """All data fields in sequence."""
        return [word for line in self.lines for word in (w.strip() for w in line.split(",")) if word]


def mesh_blocks(where: str, text: str) -> tuple[list[DeckBlock], list[str]]:
    """Return the blocks of a deck that concern its mesh, and in words what was left out.

    Raises
    ------
    MeshError
        If the text is no deck, has several parts, moves its instance, or makes nodes or elements by keywords.
    """
    blocks = list(_blocks(where, text))
    if not blocks:
        raise MeshError(f"{where}: expected an Abaqus deck (keyword lines such as *NODE), got {text[:30]!r}")
    _refuse(where, blocks)
    blocks, notes = _one_part(where, blocks)
    return blocks, notes + _left_out(blocks)


def _blocks(where: str, text: str) -> Iterator[DeckBlock]:
    """Yield the blocks of a deck; comment lines (**) may stand anywhere."""
    head, head_line = "", 0
    lines: list[str] = []
    for number, line in enumerate(text.splitlines(), start=1):
        stripped = line.strip()
        if not stripped or stripped.startswith("**"):
            continue
        if stripped.startswith("*"):
            if head:
                yield _block(where, head, head_line, lines)
            head, head_line, lines = stripped, number, []
        elif head.endswith(",") and not lines:
            head += stripped
        elif head:
            lines.append(stripped)
        else:
            raise MeshError(f"{where}, line {number}: expected a keyword line (*...), got {stripped[:40]!r}")
    if head:
        yield _block(where, head, head_line, lines)


def _block(where: str, head: str, line_number: int, lines: list[str]) -> DeckBlock:
    keyword, *parts = (part.strip() for part in head[1:].split(","))
    parameters = {}
    for part in parts:
        if part:
            key, _, value = part.partition("=")
            parameters[key.strip().upper()] = value.strip().strip('"')
    return DeckBlock(" ".join(keyword.upper().split()), parameters, lines, line_number)


def _refuse(where: str, blocks: list[DeckBlock]) -> None:
    for block in blocks:
        if block.keyword in _REFUSED:
            raise MeshError(
                f"{where}, line {block.line_number}: *{block.keyword} is not read: {_REFUSED[block.keyword]}"
            )
        if block.keyword in ("NODE", "ELEMENT", "NSET", "ELSET") and "INPUT" in block.parameters:
            raise MeshError(
                f"{where}, line {block.line_number}: *{block.keyword}, INPUT=... is not read: put the "
                f"included text into this file"
            )
        if block.keyword == "NODE" and block.parameters.get("SYSTEM", "R").upper() != "R":
            raise MeshError(
                f"{where}, line {block.line_number}: *NODE in a cylindrical or spherical system is not "
                f"read: write the nodes in global coordinates"
            )


def _one_part(where: str, blocks: list[DeckBlock]) -> tuple[list[DeckBlock], list[str]]:
    """Return the blocks of a deck without parts, or of its only part, and what was left out."""
    parts = [b for b in blocks if b.keyword == "PART"]
    instances = [b for b in blocks if b.keyword == "INSTANCE"]
    if not parts and not instances:
        return blocks, []
    if len(parts) > 1 or len(instances) > 1:
        raise MeshError(
            f"{where}: the deck has {len(parts)} parts and {len(instances)} instances; expected one part "
            f"with one instance. Export one part, or the assembly as a flat deck"
        )
    for instance in instances:
        if instance.lines:
            raise MeshError(
                f"{where}, line {instance.line_number}: the instance is moved (translation or rotation "
                f"lines below *INSTANCE), which is not read; export a flat deck"
            )
    name = instances[0].parameters.get("NAME", "") if instances else ""
    kept, notes, scope, assembly_nodes = [], [], "", 0
    for block in blocks:
        if block.keyword in ("PART", "INSTANCE", "ASSEMBLY"):
            scope = block.keyword
        elif block.keyword == "END PART":
            scope = ""
        elif block.keyword == "END INSTANCE":
            scope = "ASSEMBLY"
        elif block.keyword == "END ASSEMBLY":
            scope = ""
        elif scope in ("PART", "INSTANCE") or block.keyword not in ("NODE", "ELEMENT", "NSET", "ELSET"):
            kept.append(block)
        elif block.keyword in ("NSET", "ELSET") and block.parameters.get("INSTANCE", "").upper() == name.upper() != "":
            kept.append(block)
        else:
            assembly_nodes += 1
    if assembly_nodes:
        notes.append(
            f"{assembly_nodes} blocks of nodes, elements or sets of the assembly itself (such as reference "
            f"points) were left out"
        )
    return kept, notes


def _left_out(blocks: list[DeckBlock]) -> list[str]:
    """Name what has to do with the mesh but is not read."""
    counts: dict[str, int] = {}
    for block in blocks:
        if block.keyword in ("SURFACE", "TIE", "MPC", "EQUATION", "COUPLING", "RIGID BODY", "TRANSFORM"):
            counts[block.keyword] = counts.get(block.keyword, 0) + 1
    return [f"{count} blocks *{keyword} were left out" for keyword, count in counts.items()]
