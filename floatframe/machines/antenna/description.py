"""Numbers of the antenna."""

from dataclasses import dataclass, field

import numpy as np

from floatframe.machines.antenna.closed_forms import AntennaGeometry, mechanism

__all__ = ["Antenna"]


@dataclass(frozen=True)
class Antenna:
    """Numbers of the antenna [m, kg, s]; docs/machines/antenna.md says where they come from."""

    n_petals: int = 12
    geometry: AntennaGeometry = field(default_factory=AntennaGeometry)
    petal_length: float = 4.0
    petal_width: float = 0.3
    n_along: int = 20  #: cells of a petal
    n_across: int = 2
    bus_mass: float = 900.0
    bus_inertia: tuple[float, float, float] = (420.0, 420.0, 300.0)  #: about the hinges' centre
    slider_mass: float = 6.0
    slider_inertia: float = 0.1
    stowed: float = np.deg2rad(3.0)  #: angle of the petals from the mast
    deployed: float = np.deg2rad(75.0)
    duration: float = 60.0  #: of the deployment [s]
    hinge_stiffness: float = 1.5  #: harness over each petal hinge [N m/rad], relaxed when stowed
    hinge_damping: float = 0.3  #: [N m s/rad]
    hinge_friction: float = 0.5  #: [N m]
    friction_speed: float = 0.02  #: at which friction reaches 76 % [rad/s]

    @property
    def travel(self) -> tuple[float, float]:
        """Heights of the slider, stowed and deployed."""
        found = mechanism(self.geometry, np.array([self.stowed, self.deployed]), n_petals=self.n_petals)
        return float(found.slider[0]), float(found.slider[1])
