"""What geometric stiffness adds to the reduction of a connecting rod, from the mesh file to the reduced body.

    python -m benchmarks.geometric_stiffness           # about 90 thousand dofs
    python -m benchmarks.geometric_stiffness 0.5       # 0.5 million dofs, the size the aim is stated for

tet10, two rigid interfaces (RBE2), 50 fixed-interface modes: 24 unit loads and six that are spread over the nodes, for
conversions to a Buckens frame. "added" is what `reduce(geometric=True)` does beside `reduce`, by the factorisation of
the mode set, over the whole line without it, from the mesh file. The aim is 40 %. "without the spread loads": the same
without those six; then the sizes of the modal files.
Seconds of the wall and of the processor, the second also fair on a machine that other work shares.
"""

import sys
import time
from dataclasses import replace

from benchmarks.rods import OUT, rod_file

SIZES = {"0.1": 3.0, "0.5": 1.62}  # million dofs -> element size [mm]
N_MODES = 50


def measured(million):
    """Return the body, the reduced body, stages, time of the line and time added, geometric stiffness of some kinds."""
    import cms
    import fe_models
    from cms.reduction.basis.frames import TisserandFrame, frame_condition
    from cms.reduction.geometric_stiffness.geometric_reduction import reduced_geometric_stiffness, stiffness_of_states
    from cms.reduction.geometric_stiffness.unit_states import unit_states

    path = rod_file(million, SIZES[million])
    warm_up()
    clock = Clock()
    mesh = fe_models.read_mesh(path)
    steel = fe_models.Material("steel", E=210e3, nu=0.3, rho=7.85e-9)
    fe_models.report_mesh(mesh, steel, units="mm-t-s").raise_for_errors()
    ends = [
        fe_models.rigid_interface(mesh, name, fe_models.selections.FaceGroup(name)) for name in ("big_end", "small_end")
    ]
    body = cms.couple(fe_models.solid_body(mesh, steel, name="rod", units=cms.unit_system("mm-t-s"), interfaces=ends))
    clock("mesh to coupled body")
    with cms.modes.Families(body) as families:
        modes = cms.craig_bampton(families, n_modes=N_MODES)
        clock("mode set")
        reduced = cms.reduce(families, modes, geometric=False)
        clock("reduce")
        line = clock.total()
        from cms.reduction.basis.finishing import finish

        condition = frame_condition(body, TisserandFrame())
        Phi = finish(body, modes, condition).Phi
        clock("(shapes again, not counted)")
        before = clock.total()
        reduced_geometric_stiffness(families, Phi, condition)
        clock("geometric stiffness")
        added = [b - a for a, b in zip(before, clock.total(), strict=True)]
        fewer = stiffness_of_states(body, Phi, unit_states(families, frame=condition, spread=False))
        clock("(without the spread loads)")
        whole = reduced_geometric_stiffness(families, Phi, condition)
        clock("(with them again)")
    return body, reduced, clock.stages, line, added, {"fewer": fewer, "whole": whole}


def figures(short):
    """Return what the watch keeps."""
    million = "0.1" if short else "0.5"
    *_, line, added, _ = measured(million)
    return {f"geometric stiffness over the line without it, processor time, {million} M dofs": added[1] / line[1]}


def main():
    import cms

    million = next((a for a in sys.argv[1:] if a in SIZES), "0.1")
    body, reduced, stages, line, added, made = measured(million)
    fewer, whole = made["fewer"], made["whole"]
    print(f"{body.n_dof} dofs, {reduced.n_q} modes, {12 + 6 * len(body.interfaces)} + 6 unit loads")
    for stage, (wall, cpu) in stages.items():
        print(f"  {stage:<28} {wall:7.2f} s, cpu {cpu:7.2f} s")
    print(f"added {100 * added[0] / line[0]:.0f} % of the time, {100 * added[1] / line[1]:.0f} % of the processor's")
    kinds = {"no": None, "no turned, no spread": replace(fewer, turned=None), "no spread": fewer, "all": whole}
    for kind, geometric in kinds.items():
        cms.write(replace(reduced, geometric=geometric), OUT / "rod.h5")
        print(f"modal file with {kind} geometric stiffness: {(OUT / 'rod.h5').stat().st_size / 1e6:.3f} MB")


def warm_up():
    """Compile the kernels, which are kept on disk, on a small body."""
    import cms
    from tests.bodies import bar

    body = cms.couple(bar(2, 1, 1, kind="tetra10"))
    cms.reduce(body, cms.craig_bampton(body, n_modes=1), geometric=True)


class Clock:
    """Wall and processor time of stages."""

    def __init__(self):
        self.stages = {}
        self.last = self.start = self.now()

    def now(self):
        """Wall and processor."""
        return time.perf_counter(), time.process_time()

    def __call__(self, stage):
        """Give the time since the last call to a stage."""
        here = self.now()
        self.stages[stage] = tuple(b - a for a, b in zip(self.last, here, strict=True))
        self.last = here

    def total(self):
        """Time up to the last call."""
        return tuple(b - a for a, b in zip(self.start, self.last, strict=True))


if __name__ == "__main__":
    main()
