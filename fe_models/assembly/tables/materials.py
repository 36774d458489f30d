"""The tables [materials.NAME] and [solids.NAME] of a model: materials, and the cells of solids (docs/job_file.md)."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, Field, StringConstraints, model_validator

from fe_models.elements.solids.elements import INTEGRATIONS, MASSES
from fe_models.errors import MaterialError
from fe_models.foundation.toml_file import Matrix3, Names, Table, choice, is_no_number
from fe_models.foundation.words import nearest

if TYPE_CHECKING:
    from fe_models.body.material import AnyMaterial, Material

__all__ = [
    "MaterialSection", "Name", "SolidSection", "check_all", "check_material", "isotropic_of", "material_of",
    "solid_properties",
]  # fmt: skip

Name = Annotated[str, StringConstraints(min_length=1)]
Three = tuple[float, float, float]
Tensor = tuple[tuple[float, ...], ...]

YOUNG = "a number above 0, Young's modulus [stress unit], or three along the axes 1, 2, 3 of the material"
POISSON = "a number between -1 and 0.5, Poisson's ratio, or three: nu_12, nu_13, nu_23"
ELASTICITY = "six rows of six numbers, stress by strain in the order 11 22 33 23 13 12, shear strains doubled"
SHEAR = "three numbers above 0, the shear moduli G_12, G_13, G_23, where young has three"


def one_or_three(expected: str, one: Callable[[float], bool], each: Callable[[float], bool]) -> Callable[[Any], Any]:
    """Return a function that checks one number by `one`, or three numbers by `each`."""

    def check(value: Any) -> float | Three:
        if isinstance(value, list | tuple):
            if len(value) == 3 and not any(is_no_number(x) or not each(x) for x in value):
                return float(value[0]), float(value[1]), float(value[2])
        elif not is_no_number(value) and one(value):
            return float(value)
        raise ValueError(f"expected {expected}")

    return check


moduli = one_or_three(YOUNG, lambda x: x > 0, lambda x: x > 0)
ratios = one_or_three(POISSON, lambda x: -1 < x < 0.5, lambda x: True)  # the limits of three depend on the moduli
shear_moduli = one_or_three(SHEAR, lambda x: False, lambda x: x > 0)


def tensor(value: Any) -> Tensor:
    """Return six rows of six numbers; the material checks whether they are symmetric and positive definite."""
    is_list = isinstance(value, list | tuple) and len(value) == 6
    if not is_list or any(
        not isinstance(row, list | tuple) or len(row) != 6 or any(is_no_number(x) for x in row) for row in value
    ):
        raise ValueError(f"expected {ELASTICITY}")
    return tuple(tuple(float(x) for x in row) for row in value)


Moduli = Annotated[float | Three, BeforeValidator(moduli, json_schema_input_type=Any)]
Ratios = Annotated[float | Three, BeforeValidator(ratios, json_schema_input_type=Any)]
ShearModuli = Annotated[Three, BeforeValidator(shear_moduli, json_schema_input_type=Any)]
Elasticity = Annotated[Tensor, BeforeValidator(tensor, json_schema_input_type=Any)]


class MaterialSection(Table):
    """[materials.NAME]: a material, and the cells that have it."""

    young: Moduli | None = Field(None, description=YOUNG)
    poisson: Ratios | None = Field(None, description=POISSON)
    shear: ShearModuli | None = Field(None, description=SHEAR)
    elasticity: Elasticity | None = Field(None, description=ELASTICITY)
    axes: Matrix3 | None = Field(
        None, description="the axes 1, 2, 3 of the material in mesh axes, three rows; default: the mesh axes"
    )
    density: Annotated[float, Field(ge=0)] = Field(description="a number, 0 or more, the density [mass / length^3]")
    cells: Names = Field(("all",), description='"all", the name of a group of cells, or a list of names')

    @model_validator(mode="after")
    def _one_kind(self) -> "MaterialSection":
        if self.elasticity is not None:
            for key in ("young", "poisson", "shear"):
                if getattr(self, key) is not None:
                    raise ValueError(f"{key}: elasticity already defines it; remove it")
            return self
        for key, expected in (("young", YOUNG), ("poisson", POISSON)):
            if getattr(self, key) is None:
                raise ValueError(f"{key}: missing; expected {expected}")
        is_orthotropic = isinstance(self.young, tuple)
        if is_orthotropic != isinstance(self.poisson, tuple):
            three, one = ("young", "poisson") if is_orthotropic else ("poisson", "young")
            raise ValueError(f"{one}: {three} has three numbers; an orthotropic material needs three here too")
        if is_orthotropic and self.shear is None:
            raise ValueError(f"shear: missing; expected {SHEAR}")
        if not is_orthotropic and (self.shear is not None or self.axes is not None):
            key = "shear" if self.shear is not None else "axes"
            raise ValueError(f"{key}: belongs to an orthotropic material, young = [E_1, E_2, E_3]; remove it")
        return self


def material_of(name: str, table: MaterialSection) -> "AnyMaterial":
    """Return the material that a table describes.

    Raises
    ------
    MaterialError
        If some strain would have negative energy, or the axes are invalid.
    """
    from fe_models.body.material import AnisotropicMaterial, Material, OrthotropicMaterial

    if table.elasticity is not None:
        axes = {} if table.axes is None else {"axes": table.axes}
        return AnisotropicMaterial(name, table.elasticity, table.density, **axes)
    if isinstance(table.young, tuple) and isinstance(table.poisson, tuple) and table.shear is not None:
        axes = {} if table.axes is None else {"axes": table.axes}
        return OrthotropicMaterial(name, table.young, table.shear, table.poisson, table.density, **axes)
    assert isinstance(table.young, float)  # the table has checked it
    assert isinstance(table.poisson, float)
    return Material(name, E=table.young, nu=table.poisson, rho=table.density)


def isotropic_of(section: Any, materials: Mapping[str, MaterialSection], what: str) -> "Material":
    """Return the isotropic material that a section names, or the only one.

    Parameters
    ----------
    section
        A table with the key `material`.
    materials
        The tables of the materials.
    what
        The elements that need it, for the message.

    Raises
    ------
    MaterialError
        If the material is not isotropic.
    """
    from fe_models.body.material import Material

    name = section.material or next(iter(materials))
    made = material_of(name, materials[name])
    if not isinstance(made, Material):
        raise MaterialError(
            f"materials.{name}: it is not isotropic; {what} take isotropic materials only: young = one number"
        )
    return made


def check_material(where: str, material: str | None, materials: Mapping[str, Any]) -> None:
    """Raise `ValueError` unless a section names a material that exists, or there is only one."""
    if material is None and len(materials) != 1:
        raise ValueError(f"{where}.material: missing; there are {len(materials)} materials, name one")
    if material is not None and material not in materials:
        raise ValueError(f'{where}.material = "{material}": there is no such material{nearest(material, materials)}')


def check_all(kind: str, tables: Mapping[str, Any], key: str) -> None:
    """Raise `ValueError` if a table of "all" cells or lines (`key`) is not the only one of its kind."""
    for name, table in tables.items():
        if "all" in getattr(table, key) and len(tables) > 1:
            raise ValueError(
                f'{kind}.{name}: {key} = "all", but there are {len(tables)} tables; name the {key} of each'
            )


class SolidSection(Table):
    """[solids.NAME]: material and formulation of a group of solid cells."""

    cells: Names = Field(("all",), description='"all", the name of a group of cells, or a list of names')
    material: Name | None = Field(None, description="the name of a material; default: the only one")
    integration: choice("integration", lambda: (*INTEGRATIONS, "incompatible")) = Field(  # type: ignore[valid-type]
        "full", description=f"of the stiffness, one of {', '.join((*INTEGRATIONS, 'incompatible'))}"
    )
    mass: choice("mass", lambda: MASSES) = Field(  # type: ignore[valid-type]
        "consistent", description=f"one of {', '.join(MASSES)}"
    )


def solid_properties(
    solids: Mapping[str, SolidSection], materials: Mapping[str, MaterialSection], mass_of_all: str | None = None
) -> "dict[tuple[str, str], dict[str, AnyMaterial]]":
    """Return the material of each group of solid cells, by integration and kind of mass.

    Parameters
    ----------
    mass_of_all
        "lumped" for all solids, or "consistent" for those that a table would lump; others: by the tables.
    """
    made = {name: material_of(name, each) for name, each in materials.items()}
    rules: dict[tuple[str, str], dict[str, AnyMaterial]] = {}
    for table in solids.values():
        mass = table.mass
        if mass_of_all == "lumped" or (mass_of_all == "consistent" and mass == "lumped"):
            mass = mass_of_all
        of_group = dict.fromkeys(table.cells, made[table.material or next(iter(made))])
        rules.setdefault((table.integration, mass), {}).update(of_group)
    return rules
