"""What the figures aim at, and why an aim is missed; the page of figures begins with them."""

from dataclasses import dataclass

__all__ = ["AIMS", "Aim"]


@dataclass(frozen=True)
class Aim:
    """The aim of a figure of a benchmark."""

    module: str
    name: str  #: the figure
    value: float
    reason: str = ""  #: why it is missed

    def is_met(self, figure: float, *, more_is_better: bool) -> bool:
        """Whether a figure is at least as good as the aim."""
        return figure >= self.value if more_is_better else figure <= self.value


STEP = "a step is two residuals and two solves with kept factors, limited by caches"

AIMS = (
    Aim("large_solid", "mesh file to modal file over the bare solver, 0.5 M dofs", 1.6,
        "50 modes need 260 columns, not the 60 of the bare solver; a single-precision factor is not accurate enough"),
    Aim("craig_bampton_vs_exudyn", "against exudyn, 48k dofs, speedup", 6.0,
        "ordering, factorisation and solves are half of our time; couplings, checks and products the rest"),
    Aim("craig_bampton_vs_exudyn", "memory beside exudyn, 48k dofs, saving", 2.0, "the factor alone takes half"),
    Aim("exudyn_hinge", "against exudyn, 25k nodes, speedup", 20.0, "grows with the mesh, see the table of its README"),
    Aim("floatframe_vs_exudyn", "against exudyn, bodies: 1, modes: 8, speedup", 25.0, STEP),
    Aim("floatframe_vs_exudyn", "against exudyn, bodies: 1, modes: 20, speedup", 40.0, STEP),
    Aim("floatframe_vs_exudyn", "against exudyn, bodies: 10, modes: 8, speedup", 30.0, STEP),
    Aim("floatframe_vs_exudyn", "against exudyn, bodies: 10, modes: 20, speedup", 45.0, STEP),
    Aim("machines", "a second of kart, kart [s]", 0.25),
    Aim("machines", "a second of bogie, straight [s]", 0.25),
    Aim("machines", "a second of railway-engine, s_curve [s]", 0.25),
    Aim("machines", "slowest step of kart, kart, over its h", 1.0),
    Aim("machines", "slowest step of bogie, straight, over its h", 1.0),
    Aim("machines", "slowest step of railway-engine, s_curve, over its h", 1.0),
    Aim("many_runs", "integrate_many, 2 processes, speedup", 4.0,
        "the checks of step size compute companions of each run, and compare them in Python"),
    Aim("many_runs", "integrate_many without checks, 2 processes, speedup", 4.0),
    Aim("start", "first compilation: motion [s of processor]", 8.0,
        "520 functions: types and code 10 s, optimisation as a whole 7 s; the wheel brings the code, see the next row"),
    Aim("start", "first motion from the wheel [s of processor]", 8.0),
    Aim("start", "cms demo, cold [s of processor]", 25.0, "the compilations of motion and reduction"),
    Aim("start", "cms demo from the wheel, cold [s of processor]", 25.0),
    Aim("start", "cms demo, warm [s of processor]", 10.0,
        "drawing of two films and a picture takes half, the imports of its processes two seconds"),
    Aim("relative_coordinates", "step in relative over absolute coordinates, chain of 30, 8 modes each", 0.5,
        "most of a step are forces of modes and motions of markers, which both formulations need"),
    Aim("films", "film of corner [s]", 15.0),
    Aim("films", "page of corner [MB]", 3.0),
)  # fmt: skip
