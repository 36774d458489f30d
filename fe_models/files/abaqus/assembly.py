"""Assemblies of Abaqus: instances of parts are converted to one flat deck.

The numbers of nodes and elements are shifted: by k S in the k-th of n instances (from 0), and by n S in the assembly
itself, where S is a power of ten above all numbers. Sets of an instance are named `INSTANCE.set`, as in Abaqus. In
lines that name `INSTANCE.17`, it is replaced by the new number of that node.
"""

import re
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from fe_models.errors import MeshError
from fe_models.files.abaqus.blocks import DeckBlock
from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted

__all__ = ["TURNED", "flat_assembly", "only_part"]

#: parameter added here to blocks whose components are along the axes of an instance: the nine numbers of R
TURNED = "TURNED WITH ITS INSTANCE"

#: parameter with the name of the set, for each keyword
SETS = {"NSET": "NSET", "ELSET": "ELSET", "NODE": "NSET", "ELEMENT": "ELSET"}
NAMES = (
    "NSET",
    "ELSET",
    "NAME",
    "SURFACE",
    "REF NODE",
    "ROT NODE",
    "ORIENTATION",
)  #: parameters whose values are names within a part


class FlatAssembly(NamedTuple):
    """Deck with its instances expanded."""

    blocks: list[DeckBlock]
    notes: list[str]  #: notes on how the numbers follow from those of the deck
    #: instances whose numbers were shifted, the k-th by k step; empty if numbers are those of the deck
    instances: tuple[str, ...] = ()
    step: int = 0


def flat_assembly(where: str, blocks: list[DeckBlock]) -> FlatAssembly:
    """Return the blocks of a deck with expanded instances, and notes on the relation to its numbers.

    Raises
    ------
    MeshError
        If an instance names no part, or its position is invalid.
    """
    parts, instances, own, model = _sorted(where, blocks)
    if not instances:
        return FlatAssembly(blocks if not parts else [*(b for part in parts.values() for b in part), *model], [])
    inside = [b for part in parts.values() for b in part] + [b for _, extra in instances for b in extra] + own
    step = 10 ** len(str(max([_largest(block) for block in inside] or [1])))
    out: list[DeckBlock] = []
    offsets: dict[str, int] = {}
    for k, (head, extra) in enumerate(instances):
        name, part = head.parameters.get("NAME", ""), head.parameters.get("PART", "").upper()
        if part not in parts and not extra:
            raise MeshError(f"{where}, {head.place}: *INSTANCE of an unknown part {quoted(part)}{nearest(part, parts)}")
        offsets[name.upper()] = k * step
        R, t = _motion(where, head)
        out += [_placed(block, name, k * step, R, t) for block in [*parts.get(part, []), *extra]]
    for block in own:
        of = offsets.get(block.parameters.get("INSTANCE", "").upper())
        prefix = block.parameters.get("INSTANCE", "") if of is not None else ""
        offset = len(instances) * step if of is None else of
        if block.keyword in SETS:
            out.append(_numbered(block, offset, prefix))
        else:
            out.append(block)
    out = [_resolved(block, offsets) for block in [*out, *model]]
    words = [f"{name}: numbers of the deck + {offset}" for name, offset in offsets.items()]
    words.append(f"nodes of the assembly: + {len(instances) * step}")
    has_own_nodes = any(block.keyword == "NODE" for block in own)
    if len(instances) == 1 and not has_own_nodes:
        return FlatAssembly(out, [f"instances are written out; {'; '.join(words[:8])}"] if own else [])
    names = tuple(head.parameters.get("NAME", "") for head, _ in instances)
    return FlatAssembly(out, [f"instances are written out; {'; '.join(words[:8])}"], names, step)


def only_part(where: str, blocks: list[DeckBlock]) -> tuple[list[DeckBlock], list[str]]:
    """Return the blocks of a deck without parts, or of its only part, with the names of the part, and notes.

    Raises
    ------
    MeshError
        If there are several parts or instances, or the instance is moved.
    """
    parts, instances, own, model = _sorted(where, blocks)
    if not parts and not instances:
        return blocks, []
    if len(parts) > 1 or len(instances) > 1:
        raise MeshError(
            f"{where}: the deck has {len(parts)} parts and {len(instances)} instances; expected one part "
            f"with one instance. Export one part, or the assembly as a flat deck"
        )
    for head, _ in instances:
        if head.lines:
            raise MeshError(
                f"{where}, line {head.line_number}: the instance is moved (translation or rotation "
                f"lines below *INSTANCE), which is not read; export a flat deck"
            )
    name = instances[0][0].parameters.get("NAME", "").upper() if instances else ""
    found = [*(b for part in parts.values() for b in part), *(b for _, extra in instances for b in extra)]
    left_out = 0
    for block in [*own, *model]:
        is_of_part = block.keyword in ("NSET", "ELSET") and block.parameters.get("INSTANCE", "").upper() == name != ""
        if is_of_part or block.keyword not in SETS:
            found.append(block)
        else:
            left_out += 1
    words = "blocks of nodes, elements or sets outside the part (such as reference points) were left out"
    return found, [f"{left_out} {words}"] if left_out else []


def _sorted(
    where: str, blocks: list[DeckBlock]
) -> tuple[dict[str, list[DeckBlock]], list[tuple[DeckBlock, list[DeckBlock]]], list[DeckBlock], list[DeckBlock]]:
    """Return the blocks of parts, of instances, of the assembly, and of the model."""
    parts: dict[str, list[DeckBlock]] = {}
    instances: list[tuple[DeckBlock, list[DeckBlock]]] = []
    own: list[DeckBlock] = []
    model: list[DeckBlock] = []
    target, in_assembly = model, False
    for block in blocks:
        if block.keyword == "PART":
            name = block.parameters.get("NAME", "").upper()
            if name in parts:
                raise MeshError(f"{where}, {block.place}: *PART: a second part has the name {quoted(name)}; rename it")
            target = parts[name] = []
        elif block.keyword == "INSTANCE":
            instances.append((block, []))
            target = instances[-1][1]
        elif block.keyword in ("ASSEMBLY", "END INSTANCE"):
            target, in_assembly = own, True
        elif block.keyword in ("END PART", "END ASSEMBLY"):
            target, in_assembly = model, False
        else:
            target.append(block)
    if in_assembly:
        raise MeshError(f"{where}: expected *END ASSEMBLY, got none; the deck is incomplete")
    return parts, instances, own, model


def _largest(block: DeckBlock) -> int:
    if block.keyword not in ("NODE", "ELEMENT"):
        return 1
    first = [line.split(",")[0].strip() for line in block.lines]
    return max([int(word) for word in first if word.isdigit()] or [1])


def _motion(where: str, head: DeckBlock) -> tuple[Array, Array]:
    """Return R and t of the motion x → R x + t: a translation, then a rotation by an angle about a line."""
    try:
        rows = [[float(word or 0) for word in line.rstrip(", ").split(",")] for line in head.lines]
        t = np.array([*rows[0], 0.0, 0.0, 0.0][:3]) if rows else np.zeros(3)
        if len(rows) < 2:
            return np.eye(3), t
        a, b, angle = np.array(rows[1][:3]), np.array(rows[1][3:6]), np.radians(rows[1][6])
    except (ValueError, IndexError) as error:
        raise MeshError(
            f"{where}, {head.place}: *INSTANCE: expected x, y, z and a, b, angle below ({error})"
        ) from error
    R = Rotation.from_rotvec(angle * (b - a) / np.linalg.norm(b - a)).as_matrix()
    return R, R @ (t - a) + a


def _placed(block: DeckBlock, instance: str, offset: int, R: Array, t: Array) -> DeckBlock:
    """Return a block of a part as it appears in an instance."""
    block = _numbered(block, offset, instance)
    parameters = {
        key: f"{instance}.{value}" if key in NAMES and value and not value.isdigit() else value
        for key, value in block.parameters.items()
    }
    for key in ("REF NODE", "ROT NODE"):
        if parameters.get(key, "").isdigit():
            parameters[key] = str(int(parameters[key]) + offset)
    if block.keyword in ("BEAM SECTION", "BEAM GENERAL SECTION") and not np.array_equal(R, np.eye(3)):
        n1 = block.lines[1] if len(block.lines) > 1 else "0, 0, -1"
        turned = R @ np.array([float(word or 0) for word in n1.rstrip(", ").split(",")][:3])
        line = ", ".join(repr(float(value)) for value in turned)
        return replace(block, parameters=parameters, lines=[*block.lines[:1], line, *block.lines[2:]])
    if block.keyword in ("ORIENTATION", "TRANSFORM") and block.lines:
        line = _turned_points(block, R, t)
        return replace(block, parameters=parameters, lines=[line, *block.lines[1:]])
    if block.keyword == "NODE":
        lines = []
        for line in block.lines:
            words = [word.strip() for word in line.rstrip(", ").split(",")]
            x = R @ np.array([float(word or 0) for word in [*words[1:4], "0", "0", "0"][:3]]) + t
            lines.append(", ".join([words[0], *(repr(float(value)) for value in x)]))
        return replace(block, parameters=parameters, lines=lines)
    if block.keyword in ("SPRING", "DASHPOT", "KINEMATIC") and not np.array_equal(R, np.eye(3)):
        parameters = parameters | {TURNED: " ".join(repr(float(x)) for x in R.ravel())}
    if block.keyword == "EQUATION":
        turned = {} if np.array_equal(R, np.eye(3)) else {TURNED: " ".join(repr(float(x)) for x in R.ravel())}
        return replace(block, parameters=parameters | turned, lines=_equations(block, instance, offset))
    if block.keyword == "MPC":
        return replace(block, parameters=parameters, lines=_mpcs(block, instance, offset, bool(np.any(t))))
    if block.keyword not in SETS and block.keyword in ("SURFACE", "BOUNDARY", "NODAL THICKNESS"):
        lines = [_prefixed(line, instance, offset) for line in block.lines]
        return replace(block, parameters=parameters, lines=lines)
    return replace(block, parameters=parameters)


def _equations(block: DeckBlock, instance: str, offset: int) -> list[str]:
    """Return the lines of *EQUATION, with one line for the number of terms and one for each term."""
    words = [word.strip() for line in block.lines for word in line.rstrip(", ").split(",")]
    lines, at = [], 0
    while at < len(words):
        n = int(words[at]) if words[at].isdigit() else 0
        if not 0 < n <= (len(words) - at - 1) // 3:
            raise MeshError(
                f"{block.place}: *EQUATION: expected a number of terms, then node, component, coefficient of each; got "
                f"{', '.join(words[at : at + 4])}"
            )
        rows = [words[k : k + 3] for k in range(at + 1, at + 1 + 3 * n, 3)]
        lines += [str(n), *(", ".join([_named(node, instance, offset), c, value]) for node, c, value in rows)]
        at += 1 + 3 * n
    return lines


def _mpcs(block: DeckBlock, instance: str, offset: int, is_moved: bool) -> list[str]:
    """Return the lines of *MPC: a kind, unless the line continues another one, and nodes or sets."""
    lines = []
    for line in block.lines:
        kind, *words = [word.strip() for word in line.rstrip(", ").split(",")]
        if kind.upper() == "MEANROT" and is_moved:
            raise MeshError(
                f"{block.place}: *MPC, MEANROT inside a part of which instance {quoted(instance)} is moved: its last "
                "node says an axis by its coordinates, which move along; write it into *ASSEMBLY"
            )
        head = _named(kind, instance, offset) if kind.isdigit() and kind != "0" else kind
        lines.append(", ".join([head, *(_named(word, instance, offset) for word in words)]))
    return lines


def _named(word: str, instance: str, offset: int) -> str:
    """Return the name in the flat deck of a node number or set of the part."""
    return str(int(word) + offset) if word.isdigit() else f"{instance}.{word}" if word else word


def _turned_points(block: DeckBlock, R: Array, t: Array) -> str:
    """Return the points that define axes in an instance: directions rotate, two points of an axis also translate."""
    words = [float(word or 0) for word in block.lines[0].rstrip(", ").split(",")]
    points = np.array([*words, 0.0, 0.0, 0.0][: 9 if len(words) > 6 else 6]).reshape(-1, 3)
    is_axis = block.keyword == "TRANSFORM" and block.parameters.get("TYPE", "R").upper() == "C"
    return ", ".join(repr(float(value)) for value in (points @ R.T + (t if is_axis else 0.0)).ravel())


def _prefixed(line: str, instance: str, offset: int) -> str:
    """Return a line with its first word, a set or number of the part, converted."""
    first, comma, rest = line.partition(",")
    word = first.strip()
    return f"{_named(word, instance, offset)}{comma}{rest}"


def _numbered(block: DeckBlock, offset: int, instance: str) -> DeckBlock:
    """Return nodes, elements or sets with shifted numbers; sets within sets get the names of the instance."""
    if block.keyword not in SETS or (not offset and not instance):
        return block
    lines = []
    for line in block.lines:
        words = [word.strip() for word in line.rstrip(", ").split(",")]
        if block.keyword == "NODE":
            words[0] = str(int(words[0]) + offset)
        elif "GENERATE" in block.parameters:
            words[:2] = [str(int(word) + offset) for word in words[:2]]
        else:
            words = [
                str(int(word) + offset) if word.isdigit() else f"{instance}.{word}" if instance and word else word
                for word in words
            ]
        lines.append(", ".join(words) + ("," if line.endswith(",") and block.keyword == "ELEMENT" else ""))
    return replace(block, lines=lines)


def _resolved(block: DeckBlock, offsets: dict[str, int]) -> DeckBlock:
    """Return a block in which INSTANCE.17 is replaced by the number of this node."""

    def number(match: re.Match[str]) -> str:
        of = offsets.get(match[1].strip().upper())
        return match[0] if of is None else str(int(match[2]) + of)

    pattern = re.compile(r"([^,.\s][^,.]*)\.(\d+)(?=\s*(?:,|$))")
    if block.keyword in ("NODE", "ELEMENT", "STEP", "ELASTIC", "DENSITY"):
        return block
    parameters = {key: pattern.sub(number, value) for key, value in block.parameters.items()}
    return replace(block, parameters=parameters, lines=[pattern.sub(number, line) for line in block.lines])
