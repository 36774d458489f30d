"""Pictures of `benchmarks.field` for docs/field_benchmarks.md."""

from pathlib import Path

import numpy as np

from floatframe.components.mechanisms.beam_benchmarks import PRINCETON_LINE


def draw(found: dict, folder: Path) -> None:
    """Write what was computed into a folder, one picture with a plot of each problem."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    plots = {"princeton": princeton, "misaligned": misaligned, "shaft": shaft, "buckling": buckling}
    drawn = [name for name in plots if name in found]
    rows = (len(drawn) + 1) // 2
    fig, axes = plt.subplots(rows, 2, figsize=(11, 3.75 * rows), constrained_layout=True, squeeze=False)
    for axis, name in zip(axes.flat, drawn, strict=False):
        plots[name](axis, found[name])
    fig.savefig(folder / "field_benchmarks.png", dpi=110)


def shaft(axis, found: dict) -> None:
    """Deflection of the middle over time."""
    histories(axis, found, "Shaft through its critical speed", "shaft")


def buckling(axis, found: dict) -> None:
    """Way of the middle to the side over time."""
    histories(axis, found, "Lateral buckling", "buckling")


def princeton(axis, found: dict) -> None:
    """Both displacements of the end over the angle of the load, P3."""
    load = max(load for load, _ in found["ends"])
    angles = sorted(angle for each, angle in found["ends"] if each == load)
    exact = np.array([found["ends"][load, a].r - [PRINCETON_LINE.length, 0, 0] for a in angles])
    axis.plot(angles, 1e3 * exact[:, 2], "k-", lw=2.5, alpha=0.35, label="rod by shooting")
    other = axis.twinx()
    other.plot(angles, -1e3 * exact[:, 1], "k-", lw=2.5, alpha=0.35)
    for name, mark in (("1 part, not stiffened", "x"), ("1 part", "o"), ("2 parts", "s"), ("4 parts", "+")):
        kept = [a for a in angles if (name, load, a) in found["curves"]]
        if not kept:
            continue
        u = np.array([found["curves"][name, load, a] for a in kept])
        (line,) = axis.plot(kept, 1e3 * u[:, 2], mark, ms=7, mfc="none", label=name)
        other.plot(kept, -1e3 * u[:, 1], mark, ms=7, mfc="none", color=line.get_color())
    axis.set(title="Princeton beam, P3 = 13.345 N", xlabel="angle of the load [deg]", ylabel="along the soft axis [mm]")
    other.set_ylabel("along the stiff axis [mm]")
    other.set_ylim(0, 40)
    axis.legend(loc="upper left", frameon=False)


def misaligned(axis, found: dict) -> None:
    """Way of C out of the plane over the angle of the crank."""
    turn = np.degrees(found["fold"])
    axis.plot(turn, 1e3 * found["table"][:, 2], "k-", lw=3, alpha=0.35, label="rods at rest, shooting")
    for name, (angle, C) in found["curves"].items():
        if name in ("1 part a bar", "2 parts a bar", "9 segments a bar"):
            axis.plot(np.degrees(angle), 1e3 * C[:, 2], "--", lw=1, label=name)
    axis.set(title="Four-bar with a misaligned joint", xlabel="turn of the crank [deg]", ylabel="C out of plane [mm]")
    axis.legend(frameon=False)


def histories(axis, found: dict, title: str, name: str) -> None:
    """One component of the middle over time."""
    kept = {
        "shaft": ("exact beam, 64 elements", "2 parts", "2 parts, not stiffened"),
        "buckling": ("exact beam, 64 elements", "2 parts", "17 segments", "4 parts, one function of torsion"),
    }[name]
    for k, each in enumerate(e for e in kept if e in found):
        t, r = found[each]
        style = {"color": "k", "lw": 3, "alpha": 0.35} if k == 0 else {"lw": 1.1}
        u = 1e3 * np.linalg.norm(r[:, 1:], axis=1) if name == "shaft" else 1e3 * r[:, 1]
        axis.plot(t, u, label=each, **style)
    axis.set(
        title=title, xlabel="t [s]", ylabel="deflection of the middle [mm]" if name == "shaft" else "sideways [mm]"
    )
    axis.legend(frameon=False)
