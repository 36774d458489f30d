"""Mode sets of the railway engine's body against its full finite element model: the study of docs/railway_engine.md.

    python -m benchmarks.railway_engine                  # table and pictures in build/; a quarter of an hour of a core
    python -m benchmarks.railway_engine --draw           # the same again from what was run before
    python -m benchmarks.railway_engine --size 0.75      # a coarser mesh: minutes
    python -m benchmarks.railway_engine --modes          # where the modes of the body move, free and with seats held

Body of 10602 dofs (cells of 0.5 m), rail defect at 5 m/s with steps of 0.5 ms, S-curve at 7 m/s with steps of 5 ms.
Sets with 0 to 80 vibration modes, three with 160; those that span the same as `rubin` with 20. Errors as shares of the
greatest value of the full model: of displacement (epsilon_M), strain energy (epsilon_K), force of the bushings, and
stress at four places, the worst.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

import cms
from cms.body.modal_file.file import write
from cms.jobs.body_of_job import job_body
from cms.jobs.job import read_job
from cms.pipeline import reduce_job
from fe_models.parts import engine_body_mesh
from floatframe.design.laboratory.body_study import BodyErrors, SetError, lean_body
from floatframe.machines.railway_engine.mode_sets import MORE_SETS, SETS, engine_study
from floatframe.machines.railway_engine.write_files import CASES, write_railway_engine

N_MODES = (0, 10, 20, 40, 80)
ALSO = [(name, 160) for name in ("rubin", "craig-bampton-ir", "craig-bampton")]
BUILD = Path("build") / "railway_engine"


def run(size: float) -> None:
    """Run the study and keep its results."""
    files = [write_railway_engine(BUILD, case, size=size) for case in CASES]
    write(reduce_job(BUILD / "carbody.toml"), BUILD / "carbody.h5")
    begun = time.process_time()
    rows: list[dict[str, Any]] = []

    def told(r: SetError) -> None:
        print(f"{time.process_time() - begun:6.0f} s  {words(r)}", flush=True)
        row = {key: getattr(r, key) for key in ("loading", "mode_set", "n_modes", "n_q", "force", "failure")}
        over_time = {} if r.errors is None else {
            key: np.round(getattr(r.errors, key), 9).tolist() for key in ("t", "mass", "energy")
        }  # fmt: skip
        rows.append(row | {"stress": dict(r.stress)} | over_time)
        (BUILD / "results.json").write_text(json.dumps({"size": size, "rows": rows}))

    names, also = (*SETS, "benfield-hruda"), [*((name, 20) for name in MORE_SETS), *ALSO]
    study = engine_study(files, N_MODES, sets=names, every=5, also=also, on_case=told)
    for key, each in study.full.items():
        print(f"{key}: {study.n_dof} dofs, imbalance of the rigid motion {each.imbalance:.1e}")


def where_modes_move(size: float) -> None:
    """Print frequencies of the body and the share of the kinetic energy at the mounts of the equipment."""
    write_railway_engine(BUILD, size=size)
    body, sets = lean_body(job_body(read_job(BUILD / "carbody.toml"))), engine_body_mesh(size=size).node_sets
    equipment = ("transformer", "converter", "cooler", "underfloor", "headstock", "cab")
    places = body.nodes[[int(sets[name][0]) for name in sets if name.split("_")[0] in equipment]]
    at_mount = (np.abs(body.nodes[:, None] - places).max(axis=2) < 1e-6).any(axis=1)[body.dofs[:, 0]]
    with cms.modes.Families(body) as families:
        for kind, modes in (("free", families.free_modes(n_modes=80)), ("held", families.fixed_modes(n_modes=80))):
            energy = modes.Phi * (body.M @ modes.Phi)
            share = energy[at_mount].sum(axis=0) / energy.sum(axis=0)
            for k in (*range(22), 39, 79):
                print(f"{kind} mode {k + 1:2d}: {modes.frequencies[k]:5.1f} Hz, {100 * share[k]:3.0f} % at the mounts")


def words(r: SetError) -> str:
    """Return a row of the table."""
    if r.failure:
        return f"| {r.loading} | {r.mode_set} | {r.n_modes} | | {r.failure} |"
    stress = max(r.stress.values())
    numbers = " | ".join(f"{100 * value:.2g} %" for value in (*r.largest, r.force, stress))
    return f"| {r.loading} | {r.mode_set} | {r.n_modes} | {r.n_q} | {numbers} |"


def results() -> tuple[SetError, ...]:
    """Return what `run` has kept."""
    found = []
    for row in json.loads((BUILD / "results.json").read_text())["rows"]:
        errors = BodyErrors(*(np.array(row.pop(key)) for key in ("t", "mass", "energy"))) if "t" in row else None
        found.append(SetError(**row, errors=errors))
    return tuple(found)


def main() -> None:
    """Run what is asked for, print the table and draw the pictures."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--size", type=float, default=0.5, help="largest edge of a cell [m]")
    asked.add_argument("--draw", action="store_true", help="only the table and the pictures of what was run before")
    asked.add_argument("--modes", action="store_true", help="only where the modes of the body move")
    given = asked.parse_args()
    if given.modes:
        where_modes_move(given.size)
        return
    if not given.draw:
        run(given.size)
    from floatframe.design.laboratory.body_figures import error_figure

    found = results()
    print("| loading | set | modes | coordinates | displacement | energy | force | stress |\n" + "|---" * 8 + "|")
    for result in found:
        print(words(result))
    for case in CASES:
        chosen = [r for r in found if r.loading == case and r.mode_set not in MORE_SETS]
        error_figure(chosen, n_shown=20).savefig(BUILD / f"{case}.png", dpi=160)
        print(f"wrote {BUILD / case}.png")


if __name__ == "__main__":
    main()
