"""The tables [recovery.NAME] of a reduction job: the rows of recovery tables in the modal file (docs/job_file.md)."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from cms.errors import RecoveryError
from cms.reduction.recovery.request import QUANTITIES, RecoveryRequest, Rows
from fe_models.foundation.toml_file import Table, Vector3, choice, kind_field

__all__ = ["RecoveryFile", "RecoverySection", "requests_of"]


def places(value: Any) -> tuple[str | int, ...]:
    """Return names and numbers of places as a tuple."""
    values = value if isinstance(value, list) else [value]
    if not values or any(isinstance(v, bool) or not isinstance(v, str | int) for v in values):
        raise ValueError("expected a number or name, or a list of these")
    return tuple(values)


def component_names(value: Any) -> tuple[str, ...]:
    """Return names of components as a tuple."""
    values = value if isinstance(value, list) else [value]
    if not values or any(not isinstance(v, str) for v in values):
        raise ValueError('expected names of components, such as ["uz"] or ["xx"]')
    return tuple(values)


Places = Annotated[tuple[str | int, ...], BeforeValidator(places, json_schema_input_type=Any)]


class RowsSection(Table):
    """An entry of `rows`."""

    quantity: choice("quantity", lambda: QUANTITIES) = Field(  # type: ignore[valid-type]
        description=f"kind of the rows, one of {', '.join(QUANTITIES)}"
    )
    at: Places = Field((), description="numbers or names of nodes, elements, sets, interfaces; default: all there are")
    components: Annotated[tuple[str, ...], BeforeValidator(component_names, json_schema_input_type=Any)] = Field(
        (), description="names of components, such as uz or xx; default: all"
    )
    about: Vector3 | None = Field(None, description="of net forces: the point [x, y, z]")

    @model_validator(mode="after")
    def _fits_together(self) -> "RowsSection":
        try:
            _ = self.rows
        except RecoveryError as error:
            raise ValueError(str(error)) from error
        return self

    @property
    def rows(self) -> Rows:
        """The requested rows."""
        return Rows(self.quantity, self.at, self.components, self.about)


class RecoverySection(Table):
    """[recovery.NAME]: one table of rows."""

    rows: list[RowsSection] = Field(
        min_length=1, description="a list of tables {quantity, at, components, about}, in the order of the rows"
    )
    loads_at: Places = Field((), description="nodes or node sets at which forces act too, for the static part")


class RecoveryFile(Table):
    """A file that only contains tables [recovery.NAME]."""

    kind: str = kind_field("recovery")
    recovery: dict[str, RecoverySection] = Field(min_length=1, description="tables [recovery.NAME] with rows")


def requests_of(sections: Mapping[str, RecoverySection]) -> tuple[RecoveryRequest, ...]:
    """Return the requests of the tables.

    Raises
    ------
    RecoveryError
        If rows lack a place that they need, or give a point that they do not use.
    """
    return tuple(
        RecoveryRequest(name, tuple(each.rows for each in section.rows), section.loads_at)
        for name, section in sections.items()
    )
