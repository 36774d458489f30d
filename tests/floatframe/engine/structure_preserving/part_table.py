"""Which scheme takes which part: what is refused, by what words, and the table of it in docs/integrators.md.

    python -m tests.floatframe.engine.structure_preserving.part_table

writes the table anew; a test holds the page to it, and every cell to what happens.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from tests.floatframe.engine.structure_preserving.element_parts import ELEMENT_PARTS
from tests.floatframe.engine.structure_preserving.parts import COUPLERS, METHODS, PARTS
from tests.root import ROOT

__all__ = ["PAGE", "REFUSED", "table"]

PAGE = ROOT / "docs/integrators.md"
BEGIN, END = "<!-- every part -->\n\n", "\n\n<!-- end of every part -->"


@dataclass(frozen=True)
class Refusal:
    """Why a scheme refuses parts."""

    words: str  #: of the message, after the name of the scheme
    reason: str  #: in the table


VELOCITIES = Refusal("joint 'roll' has nonholonomic constraints", "it has non-holonomic constraints")
NORMAL = Refusal("force 'rub' has friction by the normal force", "its friction depends on the reaction of its joint")
MASSLESS = Refusal("body 'soft' has a mode without mass", "its velocity has no momentum")
CONTACT = Refusal("the force of contact 'touch' depends on its initial speed", "its force depends on its history")
MEMORY = Refusal(r"'\w+' has a memory, which this scheme", "it counts angles beyond full turns, or has states")
OWN = Refusal(r"element '\w+' has states or multipliers of its own", "it has its own states or multipliers")
MULTIPLIERS = Refusal(r"element '\w+' has multipliers of its own", "its multipliers would act at both ends of a step")
ACCELERATIONS = Refusal(
    "element 'heavy' depends on accelerations", "it depends on accelerations, which the scheme does not have"
)

HELD = (
    "law that holds a position", "law that holds positions of flexible bodies", "law that holds velocities",
    "law with an equation of its own", "law with states and an equation that moves nothing",
    "rails.wheelset (normal = constraint)",
)  # fmt: skip
STATES = (
    "drives.anti-skid-brake", "drives.dc-motor", "drives.induction-motor", "drives.pid", "drives.speed-control",
    "drives.torque-map", "friction.bristles", "hydraulics.circuit", "wheels.brush-tyre", "wheels.linear-tyre",
    "wheels.magic-formula-tyre", "law with a state", "law with a stiff state",
)  # fmt: skip
USERS = ("user force", "user force with a state", "user force that is a function")
IMPACTS = ("contact with a plane", "contact with a sphere")
HEAVY = {"law that feels accelerations": ACCELERATIONS}
#: by scheme and part; all else runs
REFUSED: dict[str, dict[str, Refusal]] = {
    "`RelativeOde`": dict.fromkeys(IMPACTS, CONTACT) | {"mode without mass": MASSLESS} | HEAVY,
    "`EnergyMomentum`": {"mode without mass": MASSLESS} | HEAVY,
    "`EnergyDecaying`": {"mode without mass": MASSLESS} | HEAVY,
    "`Variational`": {
        "joint rolling-disc": VELOCITIES,
        "friction by the force in a joint": NORMAL,
        "mode without mass": MASSLESS,
    } | HEAVY | dict.fromkeys(HELD, MULTIPLIERS),
    "`Ida`": dict.fromkeys((*COUPLERS, *USERS), MEMORY) | dict.fromkeys(IMPACTS, CONTACT)
    | dict.fromkeys((*HELD, *STATES), OWN),
}  # fmt: skip


def table() -> str:
    """Return the table of what is refused: parts that fare alike in one row, with the schemes and their reasons."""
    rows: dict[tuple[Refusal | None, ...], list[str]] = {}
    for part in (*PARTS, *ELEMENT_PARTS):
        rows.setdefault(tuple(REFUSED.get(name, {}).get(part) for name in METHODS), []).append(part)
    lines = ["| part | refused by |", "|---|---|"]
    for fares, parts in rows.items():
        schemes: dict[Refusal, list[str]] = {}
        for name, each in zip(METHODS, fares, strict=True):
            if each is not None:
                schemes.setdefault(each, []).append(name)
        if schemes:
            refused = "; ".join(f"{', '.join(names)}: {each.reason}" for each, names in schemes.items())
            lines.append(f"| {listed(parts)} | {refused} |")
    return "\n".join(lines)


def listed(parts: Iterable[str]) -> str:
    """Return names in a row, those of joints and laws together."""
    groups: dict[str, list[str]] = {}
    for part in parts:
        first, _, rest = part.partition(" ")
        key = first if first in ("joint", "law") else ""
        groups.setdefault(key, []).append(rest if key else f"`{part}`" if "." in part else part)
    words = {"joint": "joints: ", "law": "laws of your own: ", "": ""}
    return "; ".join(words[key] + ", ".join(names) for key, names in groups.items())


def write() -> None:
    """Put the table into the page."""
    text = PAGE.read_text()
    begin, end = text.index(BEGIN) + len(BEGIN), text.index(END)
    PAGE.write_text(text[:begin] + table() + text[end:])


if __name__ == "__main__":
    write()
