"""How many modes until interface loads settle, with inertia relief and without.

    python -m benchmarks.reference_laboratory             # table and picture in build/; some minutes

The slender rod that is shipped (7023 dofs) in the slider-crank of the demo, up to 250 rad/s. Loads: the reaction at the
crank pin and the torque of the drive. Reference: Craig-Bampton with inertia relief and 100 vibration modes.
"""

import tempfile
from importlib.resources import files
from pathlib import Path

import floatframe as ff
from cms.body.modal_file.file import write
from cms.pipeline import reduce_job
from fe_models.parts import shipped_mesh
from floatframe.design.laboratory.figures import convergence_figure
from floatframe.files.system_file.read_system import read_system
from floatframe.results.sensors import ReactionSensor

SETS = {
    "craig-bampton": (0, 2, 5, 10, 20, 40, 60, 80, 100),
    "craig-bampton-ir": (0, 2, 5, 10, 20, 40),
    "rubin": (2, 5, 10, 20, 40),
}
T_END, H = 0.05, 5e-5


def main() -> None:
    """Print the table and draw the picture."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "rod.msh").write_bytes(shipped_mesh("slender_rod").read_bytes())
        for file in ("rod.toml", "crank.toml"):
            text = (files("cms.cli") / "data" / file).read_text()
            (folder / file).write_text(text[: text.index("[sensors")] if "[sensors" in text else text)
        write(reduce_job(folder / "rod.toml"), folder / "rod.h5")
        system, _ = read_system(folder / "crank.toml")
        sensors = (ReactionSensor("pin", "pin"), ReactionSensor("main", "main"))
        system = ff.System(
            system.bodies, system.joints, system.forces, system.units, system.name, couplers=system.couplers,
            sensors=sensors,
        )  # fmt: skip
        cases = [ff.design.laboratory.Case(kind, n) for kind, counts in SETS.items() for n in counts]
        result = ff.design.laboratory.study(
            system, "rod", folder / "rod.toml", cases, integrator=ff.GeneralizedAlpha(rho_inf=0.6), t_end=T_END, h=H,
            reference=ff.design.laboratory.Case("craig-bampton-ir", 100),
            on_case=lambda row: print(".", end="", flush=True),
        )  # fmt: skip
    print(
        "\n| set | modes | coordinates | pin force x | pin force y | drive torque | time [s] |\n"
        "|---|---|---|---|---|---|---|"
    )
    for row in result.cases:
        if row.failure:
            print(f"| {row.case.mode_set} | {row.case.n_modes} | | {row.failure} | | | |")
            continue
        told = [f"{100 * row.errors[key]:.2g} %" for key in ("pin force x", "pin force y", "main moment z")]
        print(f"| {row.case.mode_set} | {row.case.n_modes} | {row.n_q} | {' | '.join(told)} | {row.seconds:.2f} |")
    target = Path("build") / "reference_laboratory.png"
    target.parent.mkdir(exist_ok=True)
    convergence_figure(result).savefig(target, dpi=200)
    print(f"wrote {target}")


if __name__ == "__main__":
    main()
