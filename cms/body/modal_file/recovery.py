"""Recovery matrices in a modal file: the groups /recovery/<i> (docs/modal_file.md)."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from cms.body.modal_file.contents import Attribute
from cms.body.recovery_table import RecoveryTable
from cms.errors import ModalFileError
from fe_models.foundation.units import Units

if TYPE_CHECKING:
    from cms.body.modal_file.contents import Contents

__all__ = ["GROUP", "recovery_attributes", "recovery_of", "recovery_values"]

GROUP = "/recovery"
TEXTS = ("labels", "quantities", "entities", "components", "loads")
ARRAYS = ("numbers", "dimensions", "dynamic", "load_dimensions", "static")
UNITS = ("units", "load_units")  #: texts for other readers; they follow from the dimensions


def recovery_attributes(tables: Mapping[str, RecoveryTable]) -> dict[str, Mapping[str, Attribute]]:
    """Return the attributes of the groups."""
    attributes: dict[str, Mapping[str, Attribute]] = {GROUP: {"count": len(tables)}}
    for k, table in enumerate(tables.values()):
        attributes[f"{GROUP}/{k}"] = {"name": table.name, "truncated": table.truncated}
    return attributes


def recovery_values(tables: Mapping[str, RecoveryTable]) -> dict[str, Any]:
    """Return the values of the datasets by path; empty lists of texts are left out, because HDF5 cannot store them."""
    values: dict[str, Any] = {}
    for k, table in enumerate(tables.values()):
        for name in (*TEXTS, *ARRAYS, *UNITS):
            value = getattr(table, name)
            if not isinstance(value, tuple) or value:
                values[f"{GROUP}/{k}/{name}"] = value
    return values


def recovery_of(contents: "Contents", units: Units) -> dict[str, RecoveryTable]:
    """Return the tables by name.

    Raises
    ------
    ModalFileError
        If a dataset is missing, or stored units do not follow from the dimensions.
    """
    tables: dict[str, RecoveryTable] = {}
    for group in contents.numbered(GROUP):
        name = contents.attribute(group, "name", str)
        if name in tables:
            raise ModalFileError(f"{group}: a second recovery table has the name {name!r}")
        arrays = contents.arrays(group, *ARRAYS)
        texts: dict[str, Any] = {
            each: contents.strings(f"{group}/{each}") if each != "loads" or arrays["load_dimensions"].size else ()
            for each in TEXTS
        }
        table = RecoveryTable(
            name=name, system=units, truncated=contents.attribute(group, "truncated", str), **texts, **arrays
        )
        for each in UNITS:
            own = getattr(table, each)
            if own and contents.strings(f"{group}/{each}") != own:
                raise ModalFileError(
                    f"dataset {group}/{each} does not follow from the dimensions of the rows; the file was written "
                    "by a faulty writer"
                )
        tables[name] = table
    return tables
