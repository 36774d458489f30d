"""Numbers of the antenna."""

from dataclasses import dataclass, field

import numpy as np

from floatframe.machines.antenna.closed_forms import AntennaGeometry, mechanism

__all__ = ["FINE", "Antenna", "HingePlay"]


@dataclass(frozen=True)
class HingePlay:
    """Pin and bearing of a petal hinge that has play, see `floatframe.components.clearances.HingeWithPlay`."""

    radial: float = 1e-4  #: [m]
    axial: float = 1e-4  #: to each side [m]
    length: float = 0.08  #: of the bearing [m]
    pin_radius: float = 0.008
    stiffness: float = 2e6  #: of the contact in one plane, with the fitting around it [N/m]
    damping: float = 5.0  #: damping factor of the contact, relative to the approach velocity [s/m]
    friction: float = 0.15
    friction_speed: float = 0.01  #: [m/s]; a lower one asks for shorter steps at the latching


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
    begin: float | None = None  #: angle at which opening in flight begins [rad]; None: stowed
    push: float = 5.0  #: push of the drive in flight, for each petal [N]
    drag: float = 100.0 / 3  #: damping of the drive's damper, for each petal [N s/m]
    play: HingePlay | None = None  #: of the petal hinges; friction is then that of their pins
    petal_modes: int = 6  #: vibration modes beside the static ones
    strut_modes: int = 2
    stiff_struts: bool = True  #: whether the geometric stiffness of the struts is used

    @property
    def travel(self) -> tuple[float, float]:
        """Heights of the slider, stowed and deployed."""
        found = mechanism(self.geometry, np.array([self.stowed, self.deployed]), n_petals=self.n_petals)
        return float(found.slider[0]), float(found.slider[1])


#: 24 narrow petals with more modes, starting 0.05 rad before the latch; `replace(FINE, play=HingePlay())`: with play
FINE = Antenna(
    n_petals=24,
    petal_width=0.15,
    n_along=40,
    petal_modes=12,
    strut_modes=6,
    stiff_struts=False,
    begin=float(np.deg2rad(75.0) - 0.05),
)
