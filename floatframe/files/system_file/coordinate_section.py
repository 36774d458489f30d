"""Tables of the system file for coordinates of joints or between markers."""

from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from fe_models.foundation.toml_file import Matrix3, Table, Vector3, choice
from floatframe.errors import ModelError
from floatframe.files.system_file.keys import Name
from floatframe.files.system_file.place_key import PlaceOnBody, marker_of
from floatframe.model.bodies.coordinates import (
    AxialAngle,
    AxialDistance,
    Coordinate,
    JointCoordinateName,
    PointDistance,
)

__all__ = ["CoordinateSection", "NamedCoordinate", "of_joint"]

COORDINATES = {"axial-distance": AxialDistance, "axial-angle": AxialAngle, "point-distance": PointDistance}


def of_joint(value: Any) -> Any:
    """Return the table of a coordinate; "hub.angle", alone or as its key coordinate, names joint and coordinate."""
    table = {"coordinate": value} if isinstance(value, str) else value
    if not isinstance(table, dict) or table.keys() & {"joint", "type", "body"}:
        return table
    try:
        found = JointCoordinateName.of_name(str(table.get("coordinate", "")))
    except ModelError:
        if isinstance(value, str):
            raise ValueError("expected a coordinate of a joint, such as 'hub.angle', or a table") from None
        return table
    return table | {"joint": found.joint, "coordinate": found.coordinate}


class CoordinateSection(Table):
    """A coordinate of a joint, or between markers on two bodies."""

    joint: Name | None = Field(None, description="the name of a joint")
    coordinate: Name | None = Field(None, description='a coordinate of the joint; without joint "JOINT.COORDINATE"')
    type: choice("type of coordinate", lambda: tuple(COORDINATES)) | None = Field(  # type: ignore[valid-type]
        None, description=f"instead of a joint, one of {', '.join(COORDINATES)}"
    )
    body_a: Name | None = Field(None, description='the name of a body, or "ground"')
    body_b: Name | None = Field(None, description='the name of a body, or "ground"')
    marker_a: PlaceOnBody | None = Field(None, description="an interface, or a position [x, y, z] in body_a")
    marker_b: PlaceOnBody | None = Field(None, description="an interface, or a position [x, y, z] in body_b")
    triad_a: Matrix3 | None = Field(None, description="the axes of marker_a, [x axis, y axis, z axis]")
    triad_b: Matrix3 | None = Field(None, description="the axes of marker_b, [x axis, y axis, z axis]")
    axis: Vector3 | None = Field(None, description="the axis in the axes of marker_a, [x, y, z]")

    @model_validator(mode="before")
    @classmethod
    def _of_joint(cls, value: Any) -> Any:
        return of_joint(value)

    @model_validator(mode="after")
    def _joint_or_markers(self) -> "CoordinateSection":
        between = ("body_a", "body_b", "marker_a", "marker_b", "triad_a", "triad_b", "axis")
        if (self.joint is None) == (self.type is None):
            given = "both" if self.joint else "neither"
            raise ValueError(f"expected either joint and coordinate, or type with body_a and body_b, got {given}")
        if self.joint is not None:
            if self.coordinate is None:
                raise ValueError("coordinate: missing; expected a coordinate of the joint")
            for key in between:
                if getattr(self, key) is not None:
                    raise ValueError(f"a coordinate of a joint has no key {key}")
            return self
        if self.coordinate is not None:
            raise ValueError("joint: missing; expected the joint of the coordinate, also as coordinate = 'hub.angle'")
        for key in ("body_a", "body_b"):
            if getattr(self, key) is None:
                raise ValueError(f'{key}: missing; expected the name of a body, or "ground"')
        if (self.axis is None) == (self.type != "point-distance"):
            raise ValueError(
                f"axis: expected [x, y, z] in the axes of marker_a for axial-distance and axial-angle only, got "
                f"{'none' if self.axis is None else 'one'} for {self.type}"
            )
        return self

    def found(self) -> Coordinate:
        """Return the coordinate of the table."""
        if self.joint is not None:
            assert self.coordinate is not None  # ensured by the validation of the table
            return JointCoordinateName(self.joint, self.coordinate)
        assert self.body_a is not None  # ensured by the validation of the table
        assert self.body_b is not None
        a = marker_of(self.body_a, self.marker_a, self.triad_a)
        b = marker_of(self.body_b, self.marker_b, self.triad_b)
        if self.type == "point-distance":
            return PointDistance(a, b)
        return COORDINATES[str(self.type)](a, b, np.array(self.axis))


#: a coordinate that may be given by its name
NamedCoordinate = Annotated[
    CoordinateSection, BeforeValidator(of_joint, json_schema_input_type=CoordinateSection | str)
]
