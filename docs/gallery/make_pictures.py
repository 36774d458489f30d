"""Make the pictures of the gallery and of README.md: `python docs/gallery/make_pictures.py [NAME ...]`.

Names are those of MECHANISMS and of the notebooks; without one all are made. The demo's mechanism becomes a film of one
turn (gif), the others a still each; a notebook keeps what its cells show. Pictures are shipped,
small, because making them takes minutes; the documentation shows them as they are.
"""

import base64
import io
import re
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

import cms
import fe_models as fm
import floatframe as ff
from cms.assessment.rendering import Lines, Scene, Surface, render_animation
from fe_models.foundation.parametric_file import read_parametric
from floatframe.components import mechanisms
from floatframe.files.system_file.read_system import read_system
from floatframe.functions import cycloidal_spin_up
from floatframe.pictures.animation import motion_scene
from floatframe.pictures.film_times import film_times, speed_words
from floatframe.results.results_file import MemorySource

HERE = Path(__file__).resolve().parent
NOTEBOOKS = HERE.parents[1] / "notebooks"
WIDTH = 480  #: of stills and films [px]
COLORS = 128
TEXT_SCALE = 1.9  #: texts can be read at the width of a card


def slider_crank() -> None:
    """The last turn of the demo's slider-crank, at true scale."""
    from cms.cli.demo import put_inputs

    with tempfile.TemporaryDirectory() as folder:
        put_inputs(Path(folder))
        cms.write(cms.reduce_job(Path(folder) / "rod.toml"), Path(folder) / "rod.h5")
        system, run = read_system(Path(folder) / "crank.toml")
        motion = ff.integrate(system, run.integrator, t_end=run.t_end, h=run.h, output_every=2)
    frames = frames_of(motion, system, "Slider-crank with a slender rod", speed=0.01, fps=15)
    save_film(frames[-38:], HERE / "slider_crank.gif", fps=15)  # one revolution


def antenna() -> None:
    """The deployable antenna opening under gravity: twelve petals, moved slowly by its drive."""
    from floatframe.machines import copy_machine

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_machine("antenna", folder)
        for part in ("petal", "strut"):
            cms.write(cms.reduce_job(folder / f"{part}.toml"), folder / f"{part}.h5")
        system, run = read_system(folder / "bare.toml")
        motion = ff.kinematics(system, np.linspace(0.0, run.t_end, 41), elasticity=ff.analyses.quasi_static_bodies)
    frames = frames_of(motion, system, "Deployable antenna", speed=run.t_end / 4, fps=10)
    save_film(frames, HERE / "antenna.gif", fps=10)


def landing_gear() -> None:
    """The landing gear retracted by its jack, twice as fast."""
    from floatframe.machines import copy_machine

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_machine("landing-gear", folder)
        system, run = read_system(folder / "retraction.toml")
        motion = ff.integrate(system, run.integrator, 6.0, h=run.h, output_every=50)
    frames = frames_of(motion, system, "Retraction of a landing gear", speed=2.0, fps=10)
    save_film(frames, HERE / "landing_gear.gif", fps=10)


def landing_gear_running(
    case: str, title: str, t_begin: float, t_end: float, *, magnification: float, speed: float
) -> None:
    """A moving landing gear: braking with anti-skid on the wet patch, or the shimmy limit cycle."""
    from floatframe.machines import copy_machine

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_machine("landing-gear", folder)
        for part in ("piston", "nose_leg"):
            cms.write(cms.reduce_job(folder / f"{part}.toml"), folder / f"{part}.h5")
        system, run = read_system(folder / f"{case}.toml")
        motion = ff.integrate(replace(system, scene=()), run.integrator, t_end, h=run.h, output_every=5)
    motion = followed(motion, motion.body("carriage").r * [1, 0, 0], motion.t >= t_begin)
    frames = frames_of(motion, system, title, speed=speed, fps=12, magnification=magnification, has_glyphs=False)
    save_film(frames, HERE / f"landing_gear_{case}.gif", fps=12)


def still(name: str, title: str, make: Callable[[], tuple[ff.System, float, float]]) -> None:
    """The last instant of a motion; `make` returns system, end and step."""
    system, t_end, h = make()
    motion = ff.integrate(system, ff.GeneralizedAlpha(0.8), t_end=t_end, h=h, output_every=4)
    frames = frames_of(motion, system, title, speed=t_end, fps=12, magnification=None)
    save_still(frames[-1], HERE / f"{name}.png")


def rod_of(length: float, *, height: float, width: float, young: float = 210e9, rho: float = 7850.0, n_modes: int = 4):
    """Return a reduced beam along x with a drawn surface, interfaces "start" and "end"."""
    line = fm.beams.straight_line((0, 0, 0), (length, 0, 0), 10)
    ends = [fm.beams.line_interface(line, end, fm.selections.NodeSet(end)) for end in ("start", "end")]
    section = fm.beams.BeamProperty(fm.beams.Rectangle(height, width), fm.Material("rod", young, 0.3, rho))
    body = fm.beam_body(line, section, name="rod", units=fm.unit_system("m-kg-s"), interfaces=ends)
    body = fm.couple(body)
    return cms.reduce(body, cms.craig_bampton(body, n_modes=n_modes), frame=cms.TisserandFrame(), geometric=True)


def four_bar() -> tuple[ff.System, float, float]:
    """A driven four-bar linkage whose coupler bends."""
    drive = cycloidal_spin_up(omega=18.0, duration=0.3)
    return mechanisms.four_bar(drive=drive, flexible_coupler=rod_of(0.9, height=0.006, width=0.03)), 0.62, 5e-4


def satellite() -> tuple[ff.System, float, float]:
    """A free hub with two booms that is turned by a torque."""
    system = mechanisms.satellite(boom=rod_of(5.0, height=0.02, width=0.04, young=70e9, rho=2700.0), hub_mass=30.0)
    push = ff.PointForce("wheel", ff.Marker("hub"), torque=(0.0, 0.0, 30.0))
    return ff.System(system.bodies, system.joints, [push], system.units, "satellite turned by a torque"), 1.2, 1e-3


def chain() -> tuple[ff.System, float, float]:
    """A chain of five flexible bars, released from a horizontal position."""
    bar = rod_of(0.5, height=0.002, width=0.02, young=70e9, rho=2700.0)
    return mechanisms.chain(5, rod=bar, angles=(0.0,) * 5), 0.6, 5e-4


def bogie() -> None:
    """The railway vehicle hunts at 80 m/s, seen from a point that moves with it.

    Lateral motion is drawn 20 times larger.
    """
    from floatframe.components import rails
    from floatframe.machines import copy_machine
    from floatframe.machines.bogie import RailVehicle, flexible_frames, vehicle
    from floatframe.machines.bogie.running import with_lateral_kick

    speed, larger = 80.0, 20.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_machine("bogie", folder)
        data, frame = RailVehicle(), cms.reduce_job(folder / "frame.toml")
        laws = rails.ContactLaws(creep="fastsim", friction=0.4, strips=8)
        system = vehicle(data, speed, laws=laws, frames=flexible_frames(data, frame, speed))
        system = replace(with_lateral_kick(system, 0.1), scene=())
        motion = ff.integrate(system, ff.GeneralizedAlpha(0.8, 1e-6), 1.6, 2e-3, output_every=2)  # later a wheel climbs
    rows = motion.t >= 0.8
    arrays = {key: values[rows] for key, values in motion.source.arrays.items() if len(values) == len(rows)}
    arrays["position"] = (arrays["position"] - motion.body("body").r[rows, None] * [1, 0, 0]) * [1, larger, 1]
    arrays["euler_parameters"] = turned_more(arrays["euler_parameters"], larger)
    motion = replace(motion, source=MemorySource(arrays))
    times = film_times(motion.t, fps=10, speed=0.2)
    scene = motion_scene(motion, drawn(system), times, magnification=larger, system=system)
    here = {name: tuple(each for each in getattr(scene, name) if is_front(each)) for name in ("surfaces", "lines")}
    caption = f"5 times slower; sideways motion {larger:g} times larger"
    frames = frames_of_scene(replace(scene, **here, title=f"Bogie at {speed:g} m/s", captions=(caption,)), times.fps)
    save_film(frames, HERE / "bogie.gif", fps=10)


def is_front(drawn: Surface | Lines) -> bool:
    """Return whether a shape belongs to the front bogie: it is ahead of the middle and shorter than the body."""
    x = (drawn.nodes if isinstance(drawn, Surface) else drawn.points)[..., 0]
    return float(x.min()) > 4.0 and float(np.ptp(x)) < 6.0


def turned_more(p: np.ndarray, larger: float) -> np.ndarray:
    """Return rotations, (..., 4), with larger roll and yaw of the lateral axes.

    The rotation about them is unchanged.
    """
    R = Rotation.from_quat(p.reshape(-1, 4), scalar_first=True)
    axis = R.apply([0, 1, 0])
    lean = np.column_stack([np.arcsin(axis[:, 2]), np.zeros(len(axis)), -np.arcsin(axis[:, 0])])
    more = Rotation.from_rotvec(larger * lean) * Rotation.from_rotvec(-lean) * R
    return more.as_quat(scalar_first=True).reshape(p.shape)


def railway_engine() -> None:
    """The first bogie of the railway engine over the rail defect, ten times slower.

    Deformation is drawn 5000 times larger.
    """
    from floatframe.machines import copy_machine

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_machine("railway-engine", folder)
        cms.write(cms.reduce_job(folder / "carbody.toml"), folder / "carbody.h5")
        system, run = read_system(folder / "defect.toml")
        track = ff.shapes.Track([(-10, 0, 0), (17, 0, 0)], 1.5)
        system = replace(system, scene=(track,))
        motion = ff.integrate(system, run.integrator, t_end=1.05, h=run.h, output_every=30)
    frames = frames_of(motion, system, "Railway engine over a rail defect", speed=0.1, fps=6, magnification=5000.0)
    save_film(frames, HERE / "railway_engine.gif", fps=6)


def kart() -> None:
    """The kart with its flexible frame in a turn at 4 m/s, five times slower; deformation is drawn 20 times larger."""
    from floatframe.machines import copy_machine

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_machine("kart", folder)
        cms.write(cms.reduce_job(folder / "chassis.toml"), folder / "chassis.h5")
        system, run = read_system(folder / "kart.toml", {"speed": 4.0, "steer_at": 0.15, "duration": 0.6})
        system = replace(system, scene=())
        motion = ff.integrate(system, run.integrator, t_end=run.t_end, h=run.h, output_every=10)
    motion = followed(motion, motion.body("chassis").r - motion.body("chassis").r[0])
    frames = frames_of(motion, system, "Kart in a turn at 4 m/s", speed=0.2, fps=10, magnification=20.0)
    save_film(frames, HERE / "kart.gif", fps=10)


def road_car() -> None:
    """The road car on four posts: a wave of roll, then a wave of warp, at half speed.

    Deformation is drawn 50 times larger.
    """
    from floatframe.machines import copy_machine
    from floatframe.machines.road_car import RoadCar
    from floatframe.machines.road_car.description import CORNERS

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_machine("road-car", folder)
        cms.write(cms.reduce_job(folder / "body.toml"), folder / "body.h5")
        content = read_parametric(folder / "rig.toml", ff.errors.ModelError)
        changes: dict[str, Any] = {"height": 0.035, "is_rigid": False}
        for corner, (axle, side) in CORNERS.items():  # drawn wheels, without tyres
            place = RoadCar().axle(axle).point("centre", side).tolist()
            wheel = {"type": "wheel", "radius": 0.32, "width": 0.205, "position": place}
            shapes = content["bodies"][f"upright_{corner}"]["shapes"]
            changes[f"bodies.upright_{corner}.shapes"] = [wheel, *shapes]
        system, run = read_system(folder / "rig.toml", changes)
        motion = ff.integrate(system, run.integrator, run.t_end, h=run.h, output_every=5)
    frames = frames_of(motion, system, "Road car on four posts", speed=0.5, fps=10, magnification=50.0)
    save_film(frames, HERE / "road_car.gif", fps=10)


def road_car_plots() -> None:
    """Two plots of the page of the road car: the lane change, and wheel angles over wheel travel."""
    import matplotlib.pyplot as plt

    from floatframe.machines import copy_machine
    from floatframe.machines.road_car import Linkage, RoadCar
    from floatframe.machines.road_car.figures import driven

    car = RoadCar()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_machine("road-car", folder)
        cms.write(cms.reduce_job(folder / "body.toml"), folder / "body.h5")
        figure, axes = plt.subplots(3, 2, figsize=(9, 7.5), sharex=True, layout="constrained")
        for file, words, style in (
            ("lane_change", "hydraulics, flexible", "-"), ("lane_change_rigid", "hydraulics, rigid", ":"),
            ("lane_change_bars", "bars, rigid", "--"),
        ):  # fmt: skip
            system, run = read_system(folder / f"{file}.toml")
            seen = driven(system, ff.integrate(system, run.integrator, run.t_end, run.h, output_every=run.output_every))
            for ax, values, label in (
                (axes[0, 0], seen.place[:, 1], "across the road [m]"),
                (axes[0, 1], seen.lateral_acceleration, "lateral acceleration [m/s²]"),
                (axes[1, 0], np.degrees(seen.roll), "roll [degrees]"),
                (axes[1, 1], np.degrees(seen.side_slip), "side-slip [degrees]"),
                (axes[2, 0], seen.loads / 1e3, "loads of the wheels [kN]"),
                (axes[2, 1], seen.pressures / 1e5, "pressures of the lines [bar]"),
            ):
                if values.ndim == 1:
                    ax.plot(seen.t, values, style, label=words)
                for k in range(values.shape[1] if values.ndim == 2 else 0):
                    ax.plot(seen.t, values[:, k], style, color=f"C{k}")
                ax.set_ylabel(label)
        axes[0, 0].legend(fontsize=8)
        for ax in axes[2]:
            ax.set_xlabel("t [s]")
        figure.savefig(HERE.parent / "road_car_lane_change.png", dpi=80)
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    travel = np.linspace(-0.08, 0.08, 41)
    for k, name in enumerate(("front", "rear")):
        places = [Linkage(car.axle(name), 1).lifted(z) for z in travel]
        axes[0].plot(1e3 * travel, [np.degrees(place.inclination) for place in places], f"C{k}", label=name)
        axes[1].plot(1e3 * travel, [np.degrees(place.steer) for place in places], f"C{k}")
    for ax, words in zip(axes, ("inclination of the left wheel [degrees]", "its steer [degrees]"), strict=True):
        ax.set(xlabel="travel [mm]", ylabel=words)
        ax.grid(alpha=0.3)
    axes[0].legend()
    figure.savefig(HERE.parent / "road_car_wheels.png", dpi=80)


def road_car_study(journal: Path | None = None) -> None:
    """The study of the road car's suspension: its history, and the lane change before and after; this takes minutes."""
    import matplotlib.pyplot as plt

    from floatframe.design.optimization.history_plots import plot_history
    from floatframe.machines import copy_machine
    from floatframe.machines.road_car.figures import driven

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_machine("road-car", folder)
        cms.write(cms.reduce_job(folder / "body.toml"), folder / "body.h5")
        design = ff.design.read_design(folder / "suspension_study.toml")
        best = ff.design.optimize(design, journal=journal)
        plot_history(best).savefig(HERE.parent / "road_car_study.png", dpi=70)
        after = {path: best.values[p.name] for p in design.parameters for path in p.paths}
        figure, axes = plt.subplots(1, 3, figsize=(10, 3), layout="constrained")
        for changes, words in (({}, "before"), (after, "after")):
            system, run = read_system(folder / "lane_change_bars.toml", changes)
            seen = driven(system, ff.integrate(system, run.integrator, run.t_end, run.h, output_every=run.output_every))
            for ax, values, label in zip(
                axes, (100 * seen.error, np.degrees(seen.side_slip), np.degrees(seen.roll)),
                ("off the path [cm]", "side-slip [degrees]", "roll [degrees]"), strict=True,
            ):  # fmt: skip
                ax.plot(seen.t, values, label=words)
                ax.set(xlabel="t [s]", ylabel=label)
                ax.grid(alpha=0.3)
        axes[0].legend()
        figure.savefig(HERE.parent / "road_car_before_after.png", dpi=80)


def flexible_arm() -> None:
    """The flexible arm under its three controllers."""
    from floatframe.machines.flexible_arm import compared, links, moves, plot_motions

    parts = links()
    plot_motions(compared(parts, moves(parts))).savefig(HERE.parent / "flexible_arm.png", dpi=80)


MECHANISMS: dict[str, Callable[[], None]] = {
    "slider_crank": slider_crank,
    "antenna": antenna,
    "railway_engine_film": railway_engine,
    "kart_film": kart,
    "bogie_film": bogie,
    "landing_gear_film": landing_gear,
    "road_car_film": road_car,
    "flexible_arm": flexible_arm,
    "road_car_plots": road_car_plots,
    "road_car_study": road_car_study,
    "landing_gear_braking": partial(
        landing_gear_running, "braking", "Braking with anti-skid", 1.9, 2.4, magnification=5.0, speed=0.1
    ),
    "landing_gear_shimmy": partial(
        landing_gear_running, "shimmy", "Shimmy of a nose gear", 2.8, 3.0, magnification=1.0, speed=0.04
    ),
    "four_bar": partial(still, "four_bar", "Four-bar linkage", four_bar),
    "satellite": partial(still, "satellite", "Satellite turned by a torque", satellite),
    "chain": partial(still, "chain", "Chain of five bars", chain),
}


#: the pictures of notebooks that other pages show, by number, as NAME_NUMBER.png
SHOWN = {
    "mesh_to_motion": (2,), "from_your_fe_program_to_a_motion": (2,), "suspension_arm": (0,), "railway_engine": (2,),
    "landing_gear": (0,), "motor_bogie": (1,), "road_car": (1,), "mode_families": (10,), "vehicle_manoeuvres": (2,),
    "slender_beams": (0,), "robot": (0,), "controlled_arm": (0,), "spacecraft_tower": (0,), "railway_stability": (0, 1),
}  # fmt: skip


def notebook(path: Path) -> None:
    """Run a notebook, store what its cells show in it, and the pictures that other pages show."""
    import nbformat
    from nbclient import NotebookClient

    document = nbformat.read(path, as_version=4)
    metadata = document.metadata
    folder = {"metadata": {"path": str(path.parent.parent)}}
    NotebookClient(document, timeout=1800, resources=folder, record_timing=False).execute()
    document.metadata = metadata
    pictures = []
    for cell in document.cells:
        if cell.cell_type == "code":
            cell.outputs = [output for output in cell.outputs if output.get("name") != "stderr"]
            for output in cell.outputs:
                if "text" in output:
                    for place in (rf"{re.escape(tempfile.gettempdir())}/\w+/", re.escape(f"{path.parent.parent}/")):
                        output.text = re.sub(place, "", output.text)
                data = output.get("data", {})
                if "image/png" in data:
                    picture = Image.open(io.BytesIO(base64.b64decode(data["image/png"])))
                    pictures.append(small(np.asarray(picture.convert("RGB")), width=900))
                    data["image/png"] = base64.b64encode(pictures[-1]).decode("ascii")
    nbformat.write(document, path)
    for number in SHOWN.get(path.stem, ()):
        (HERE / "notebooks" / f"{path.stem}_{number}.png").write_bytes(pictures[number])
    print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB, {len(pictures)} pictures", flush=True)


def drawn(system: ff.System) -> dict:
    """Return the shapes of the bodies of a system, by name."""
    return {body.name: getattr(body, "reduced", body) for body in system.bodies}


def followed(motion: ff.Trajectory, away: np.ndarray, rows: np.ndarray | slice = slice(None)) -> ff.Trajectory:
    """Return some rows of a motion, seen from a point that moves by `away`, (n_t, 3) [m]."""
    n = len(motion.t)
    arrays = {key: values[rows] for key, values in motion.source.arrays.items() if len(values) == n}
    arrays["position"] = arrays["position"] - away[rows, None]
    return replace(motion, source=MemorySource(arrays))


def frames_of(
    motion: ff.Trajectory, system: ff.System, title: str, *, speed: float, fps: float,
    magnification: float | None = 1.0, has_glyphs: bool = True,
) -> list[np.ndarray]:  # fmt: skip
    """Return the frames of a film, (height, width, 3) each, with texts that can be read at the width of a card."""
    shapes = drawn(system)
    times = film_times(motion.t * motion.units.time, fps=fps, speed=speed)
    scene = motion_scene(
        motion, shapes, times, magnification=magnification, system=system if has_glyphs else None
    )  # fmt: skip
    caption = "; ".join([speed_words(float(f"{speed:.2g}")), *scene.captions[0].split("; ")[1:]])
    caption = caption.replace(" than real time", "").replace("elastic displacement drawn", "deformation")
    return frames_of_scene(replace(scene, title=title, captions=(caption,)), times.fps)


def frames_of_scene(scene: Scene, fps: float) -> list[np.ndarray]:
    """Return the frames of a scene without the names of its places."""
    with tempfile.TemporaryDirectory() as folder:
        film = Path(folder) / "film.gif"
        render_animation(replace(scene, triads=(), text_scale=TEXT_SCALE), film, fps=fps)
        return [frame[..., :3] for frame in iio.imread(film)]


def save_still(frame: np.ndarray, path: Path, *, width: int = WIDTH) -> None:
    """Write a picture with few colours."""
    path.write_bytes(small(frame, width=width))
    print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB", flush=True)


def small(frame: np.ndarray, *, width: int) -> bytes:
    """Return a picture with few colours as a PNG."""
    picture = Image.fromarray(frame)
    if picture.width > width:
        picture = picture.resize((width, round(picture.height * width / picture.width)), Image.Resampling.LANCZOS)
    picture.quantize(COLORS, dither=Image.Dither.NONE).save(stored := io.BytesIO(), format="PNG", optimize=True)
    return stored.getvalue()


def save_film(frames: list[np.ndarray], path: Path, *, fps: float) -> None:
    """Write a film with one table of few colours."""
    height = max(len(frame) for frame in frames)
    pictures = []
    for frame in frames:
        whole = np.full((height, frame.shape[1], 3), frame[0, 0], dtype=np.uint8)
        whole[: len(frame)] = frame
        picture = Image.fromarray(whole)
        pictures.append(picture.resize((WIDTH, round(height * WIDTH / picture.width)), Image.Resampling.LANCZOS))
    colors = pictures[len(pictures) // 2].quantize(COLORS, dither=Image.Dither.NONE)
    tables = [picture.quantize(COLORS, palette=colors, dither=Image.Dither.NONE) for picture in pictures]
    tables[0].save(path, save_all=True, append_images=tables[1:], duration=1000 / fps, loop=0, optimize=True)
    print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB, {len(frames)} pictures")


def main(names: list[str]) -> None:
    """Make the named pictures, or all."""
    books = {path.stem: partial(notebook, path) for path in sorted(NOTEBOOKS.glob("*.ipynb"))}
    makers = MECHANISMS | books
    unknown = [name for name in names if name not in makers]
    if unknown:
        sys.exit(f"no picture {unknown[0]!r}; choices: {', '.join(makers)}")
    for name in names or makers:
        makers[name]()


if __name__ == "__main__":
    main(sys.argv[1:])
