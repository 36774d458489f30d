"""The head of a results file: all content besides arrays, as JSON text that is validated by the types of its fields."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cache
from typing import Annotated, Any, ClassVar

from pydantic import ConfigDict, Field, GetPydanticSchema, TypeAdapter, ValidationError
from typing_extensions import TypedDict

from fe_models.foundation.presentation import presented
from fe_models.foundation.units import UNIT_SYSTEMS
from fe_models.foundation.words import quoted
from floatframe.engine.compiling.counted_angles import CountedAngle

__all__ = ["BodyEntry", "Head", "head_of_text", "text_of_head"]

Count = Annotated[int, Field(ge=0)]
#: words in messages of pydantic, and ours
WORDS = {
    "Input should be greater than or equal to": "expected at least", "Input should be": "expected",
    "List should have": "expected", "Tuple should have": "expected", " after validation": "",
    "a valid string": "text", "a valid integer": "a whole number", "a valid boolean": "true or false",
    "a valid array": "a list", "a valid": "a", "Field required": "missing",
    "Unexpected keyword argument": "unknown key",
}  # fmt: skip
ANY_OTHER_KEYS = ConfigDict(extra="allow", strict=True, allow_inf_nan=False)


class RunRecord(TypedDict, total=False):
    """Entries of the run that this program reads; the integrator adds its parameters."""

    __pydantic_config__ = ANY_OTHER_KEYS  # type: ignore[misc]
    integrator: str
    t_start: float
    t_end: float
    h: float
    output_every: Annotated[int, Field(ge=1)]
    gravity: Annotated[list[float], Field(min_length=3, max_length=3)]
    error_tolerance: float | None
    system_file: str
    system_file_digest: str
    changes: dict[str, Any]
    digest: str
    floatframe: str


class EventRecord(TypedDict):
    """An event that happened during the run."""

    __pydantic_config__ = ANY_OTHER_KEYS  # type: ignore[misc]
    name: str
    t: float
    stop: bool
    switch_on: list[str]
    switch_off: list[str]


class SummaryRecord(TypedDict, total=False):
    """Entries of the summary that this program reads."""

    __pydantic_config__ = ANY_OTHER_KEYS  # type: ignore[misc]
    n_steps: Count
    n_rejected: Count
    n_iterations: Count
    wall_time: float
    watched: dict[str, float | list[float]]
    events: list[EventRecord]
    left_out: dict[str, dict[str, float]]


@presented
@dataclass(frozen=True)
class BodyEntry:
    """The columns of a body in the arrays of a results file."""

    name: str
    n_q: Count
    q0: int  #: first column in q
    u0: int  #: first column in u
    source: str = ""  #: path of the modal file; "" for rigid bodies and bodies made in memory
    digest: str = ""  #: digest of the modal file
    is_stiffened: bool = False  #: whether its geometric stiffness is used


@presented
@dataclass(frozen=True)
class Head:
    """The content of a results file besides arrays."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    system: str
    units: str  #: name of the unit system
    bodies: Annotated[tuple[BodyEntry, ...], Field(min_length=1)]
    joints: tuple[str, ...]
    springs: tuple[str, ...]
    #: first column in w of each connection (joints, springs, couplers, user forces), then the number of columns
    w0: tuple[int, ...]
    #: integrator and its parameters, h, t_end, version
    run: Annotated[Mapping[str, Any], GetPydanticSchema(lambda _, handler: handler(RunRecord))]
    #: for a completed run: n_steps, n_rejected, n_iterations (Newton), wall_time [s]
    summary: Annotated[Mapping[str, Any], GetPydanticSchema(lambda _, handler: handler(SummaryRecord))] = field(
        default_factory=dict
    )
    angles: tuple[CountedAngle, ...] | None = None  #: angles in the columns of `angle`; None: not counted
    #: for each sensor, descriptions of the nodes that it uses on flexible bodies, with their distance from the given
    #: points
    places: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    loads: tuple[str, ...] | None = None  #: point forces, in the order of `load`; None: not written
    load_cases: tuple[str, ...] | None = None  #: load cases, in the order of `load_case`; None: not written


def text_of_head(head: Head) -> str:
    """Return the head as JSON text."""
    return json.dumps(asdict(head))


@cache
def adapter() -> TypeAdapter[Head]:
    """Return the reader of heads."""
    return TypeAdapter(Head)


def head_of_text(text: Any) -> Head:
    """Return the head for a JSON text.

    Raises
    ------
    ValueError
        If it is not a head, or is inconsistent; the message names the key.
    """
    try:
        head = adapter().validate_json(text)
    except ValidationError as error:
        problem = error.errors(include_url=False)[0]
        where = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in problem["loc"])
        words = problem["msg"]
        for of_pydantic, own in WORDS.items():
            words = words.replace(of_pydantic, own)
        raise ValueError(f"head{where}: {words}, got {quoted(problem['input'])}") from None
    require(head.units in UNIT_SYSTEMS, "units", f"one of {', '.join(UNIT_SYSTEMS)}", head.units)
    q0 = u0 = 0
    for k, body in enumerate(head.bodies):
        for name, got, first in (("q0", body.q0, q0), ("u0", body.u0, u0)):
            require(got == first, f"bodies[{k}].{name}", f"{first}, after the body before", got)
        is_new = body.name not in [each.name for each in head.bodies[:k]]
        require(is_new, f"bodies[{k}].name", "a name of its own", body.name)
        q0, u0 = q0 + body.n_q, u0 + 6 + body.n_q
    # couplers and user forces also have columns, after those of joints and springs, but no names in these lists
    n_connections, w0 = len(head.joints) + len(head.springs), head.w0
    require(len(w0) > n_connections and w0[0] == 0 and list(w0) == sorted(w0),
            "w0", f"at least {n_connections + 1} whole numbers that ascend from 0", w0)  # fmt: skip
    for k, angle in enumerate(head.angles or ()):
        for name, number in (("holder", angle.holder), ("other", angle.other)):
            is_body = -1 <= number < len(head.bodies)
            require(is_body, f"angles[{k}].{name}", f"a whole number from -1 to {len(head.bodies) - 1}", number)
        require(angle.sign in (-1.0, 1.0), f"angles[{k}].sign", "1 or -1", angle.sign)
        require(-1 <= angle.part < 3, f"angles[{k}].part", "a whole number from -1 to 2", angle.part)
    is_pair = (head.loads is None) == (head.load_cases is None)
    require(is_pair, "load_cases", "a list of names with that of loads", head.load_cases)
    return head


def require(holds: bool, where: str, expected: str, got: Any) -> None:
    """Raise `ValueError` with a key of the head unless a condition is true."""
    if not holds:
        raise ValueError(f"head.{where}: expected {expected}, got {quoted(got)}")
