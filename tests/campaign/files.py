"""Modal files and results files: bytes that are damaged, and heads and numbers that are changed and sealed again.

Damaged bytes must be refused, or say what the whole file says. What was sealed again is a file of another writer: it
must be refused, or what is read must be what stands in it, be finite and fit together.
"""

import json
import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tests.campaign.jobs import JOB
from tests.campaign.mutation import damaged_bytes
from tests.campaign.plain_mesh import FORMATS, bar
from tests.campaign.systems import SYSTEM
from tests.campaign.verdict import ACCEPTED, WRONG, Verdict, ask, judged

__all__ = ["bytes_case", "head_case", "prepared"]

WILD = (-1, 0, 1, 10**9, -(10**12), 2**62, 1e308, -1.5, float("nan"), float("inf"), "", "text", "[1", "x" * 100_000)


def prepared(folder: Path) -> Path:
    """Return a folder with a modal file, a results file and the segments of an interrupted run; made once a process."""
    if not (folder / "ready").exists():
        import floatframe.simulation.integrate as integration
        from floatframe.files.system_file.read_system import read_system

        folder.mkdir(parents=True, exist_ok=True)
        (folder / "bar.msh").write_text(FORMATS["msh"](*bar()))
        (folder / "job.toml").write_text(JOB)
        (folder / "system.toml").write_text(SYSTEM)
        for words in (
            ("cms", "reduce", folder / "job.toml", "-o", folder / "modal.h5"),
            ("floatframe", "run", folder / "system.toml", "-o", folder / "results.h5"),
        ):
            reply = ask(*words)
            assert reply.code == 0, f"{words[:2]}: {reply.fault} {reply.stderr[-600:]}"
        system, run = read_system(folder / "system.toml")

        def stop(progress: Any) -> None:
            if progress.n_steps >= 600:
                raise KeyboardInterrupt

        seconds, integration.SEGMENT_SECONDS = integration.SEGMENT_SECONDS, 0.0
        try:
            integration.integrate(system, run.integrator, 1.0, 1e-3, output=folder / "half.h5", progress=stop)
        except KeyboardInterrupt:
            pass
        finally:
            integration.SEGMENT_SECONDS = seconds
        (folder / "ready").touch()
    return folder


def looked_at(path: Path) -> tuple[str, Any]:
    """Return how a file is asked what it says."""
    program = "cms" if path.name == "modal.h5" else "floatframe"
    return program, ask(program, "info", path, "--json")


def bytes_case(seed: int, folder: Path) -> Verdict:
    """Damage the bytes of a modal file, a results file, or one file of a folder of segments."""
    rng, whole = np.random.default_rng([4, seed]), prepared(folder.parent / "prepared")
    names = ("modal.h5", "results.h5", "half.h5.segments")
    name = names[seed % 3]
    if name == "half.h5.segments":
        shutil.copytree(whole / name, folder / name)
        victims = sorted((folder / name).glob("*.h5"))
        victim = victims[int(rng.integers(len(victims)))]
    else:
        shutil.copy(whole / name, folder / name)
        victim = folder / name
    shutil.copy(whole / "system.toml", folder / "system.toml")
    before = victim.read_bytes()
    damaged = damaged_bytes(before, rng)
    victim.write_bytes(damaged)
    verdict = judged(looked_at(folder / name)[1])
    if verdict.kind == ACCEPTED and damaged != before:
        return Verdict(WRONG, f"{victim.name}: damaged bytes were read")
    return verdict


def head_case(seed: int, folder: Path) -> Verdict:
    """Change what a modal file or a results file says, and seal it again."""
    rng, whole = np.random.default_rng([5, seed]), prepared(folder.parent / "prepared")
    name = ("modal.h5", "results.h5")[seed % 2]
    resealed(whole / name, folder / name, rng, is_modal=seed % 2 == 0)
    verdict = judged(looked_at(folder / name)[1])
    if verdict.kind != ACCEPTED:
        return verdict
    reason = wrong_modal(folder / name) if seed % 2 == 0 else wrong_results(folder / name)
    return Verdict(WRONG, reason) if reason else verdict


def resealed(source: Path, target: Path, rng: np.random.Generator, *, is_modal: bool) -> None:
    """Copy a file with one change of an attribute, a dataset or the JSON of its head, digest and seal made anew."""
    from cms.body.modal_file.file import KIND as MODAL
    from fe_models.foundation.hdf5_file import Manifest, as_attribute, write_sealed_file
    from floatframe.results.results_file import KIND as RESULTS

    datasets: dict[str, tuple[Any, dict[str, Any]]] = {}
    groups: dict[str, dict[str, Any]] = {}
    with h5py.File(source, "r") as file:
        items = {"/": file["/"]}
        file.visititems(lambda name, item: items.update({f"/{name}": item}))
        for name, item in items.items():
            attributes = {
                key: as_attribute(value) for key, value in item.attrs.items() if key not in ("sha256", "digest")
            }
            if isinstance(item, h5py.Dataset):
                value = item[()]
                if getattr(value, "dtype", np.dtype(float)).kind in "SO":
                    value = tuple(word.decode() for word in np.ravel(value))
                datasets[name] = (value, attributes)
            else:
                groups[name] = attributes
    kind = int(rng.integers(4)) if is_modal else int(rng.integers(2, 6))
    if kind < 2:
        names = [(g, a) for g, found in groups.items() for a in found if (g, a) != ("/", "format")]
        group, attribute = names[int(rng.integers(len(names)))]
        groups[group][attribute] = WILD[int(rng.integers(len(WILD)))]
    elif kind < 4:
        changed_dataset(datasets, rng)
    else:
        head = json.loads(groups["/"]["head"])
        changed_json(head, rng)
        groups["/"]["head"] = json.dumps(head)

    def fill(file: Any) -> None:
        manifest = Manifest(file)
        for name, (value, attributes) in datasets.items():
            manifest.dataset(name, value, attributes)
        for name, attributes in groups.items():
            manifest.attributes(name, {key: value for key, value in attributes.items() if value != "\0"})
        manifest.close()

    write_sealed_file(target, MODAL if is_modal else RESULTS, fill, part=target.with_name("part"))


def changed_dataset(datasets: dict[str, tuple[Any, dict[str, Any]]], rng: np.random.Generator) -> None:
    """Change a dataset: its shape, a number, its kind; or leave it out."""
    name = list(datasets)[int(rng.integers(len(datasets)))]
    value, attributes = datasets[name]
    kind = int(rng.integers(6))
    if kind == 0:
        del datasets[name]
        return
    if isinstance(value, tuple) or kind == 1:
        value = np.zeros(3) if isinstance(value, tuple) else ("some", "words")
    elif kind == 2 and np.ndim(value):
        value = np.asarray(value)[1:]
    elif kind == 3:
        value = np.asarray(value)[None]
    else:
        array = np.array(value, dtype=float if np.asarray(value).dtype.kind == "f" else np.int64)
        if array.size:
            wild = float(rng.choice([np.nan, np.inf, 1e300, -1e300])) if array.dtype.kind == "f" else 10**9
            array.ravel()[int(rng.integers(array.size))] = wild
        value = array
    datasets[name] = (value, attributes)


def changed_json(value: Any, rng: np.random.Generator) -> None:
    """Change one value somewhere in an object of JSON, leave it out, or add one."""
    keys = list(value) if isinstance(value, dict) else list(range(len(value)))
    key = keys[int(rng.integers(len(keys)))]
    inner = value[key]
    if isinstance(inner, dict | list) and inner and rng.random() < 0.7:
        changed_json(inner, rng)
    elif rng.random() < 0.2:
        del value[key]
    elif rng.random() < 0.2 and isinstance(value, dict):
        value["more"] = 1
    else:
        value[key] = (*WILD, None, True, [], {}, [[]], [None])[int(rng.integers(len(WILD) + 6))]


def wrong_modal(path: Path) -> str:
    """Return what a modal file that was accepted says that cannot be."""
    import cms

    body = cms.read(path)
    with h5py.File(path, "r") as file:
        for name, mine in (
            ("/modes/K", body.K),
            ("/modes/D", body.D),
            ("/nodes/Phi", body.Phi),
            ("/moments/m", body.moments.m),
        ):
            if not np.array_equal(file[name][()], mine):
                return f"{name} is not what stands in the file"
        M, K = file["/modes/M"][...], file["/modes/K"][...]
        if not (np.isfinite(M).all() and np.isfinite(K).all()):
            return "M or K is not finite"
        for name in [name for name in file["/interfaces"] if isinstance(file["/interfaces"][name], h5py.Group)]:
            group = file["/interfaces"][name]
            if not all(np.isfinite(group[each][...]).all() for each in ("position", "triad", "Psi")):
                return f"interface {name} is not finite"
        if not np.isfinite(file["/moments/m"][()]) or file["/moments/m"][()] <= 0:
            return "mass"
        axes = file["/frame/axes"][...]
        if not np.isfinite(file["/frame/origin"][...]).all() or np.abs(axes.T @ axes - np.eye(3)).max() > 1e-6:
            return "frame"
    return ""


def wrong_results(path: Path) -> str:
    """Return what a results file that was accepted says that does not fit together, read by its document alone."""
    import floatframe

    motion = floatframe.read_results(path)
    with h5py.File(path, "r") as file:
        head = json.loads(file.attrs["head"])
        data = {name: item[...] for name, item in file.items()}
    n_q = [body["n_q"] for body in head["bodies"]]
    if data["q"].shape[1] != sum(n_q) or data["u"].shape[1] != sum(n_q) + 6 * len(n_q):
        return "columns of q or u"
    u0 = 0
    for i, body in enumerate(head["bodies"]):
        mine = motion.body(body["name"])
        if not np.array_equal(mine.r, data["position"][:, i], equal_nan=True) or not np.array_equal(
            mine.v, data["u"][:, u0 : u0 + 3], equal_nan=True
        ):
            return f"columns of {body['name']}"
        u0 += 6 + body["n_q"]
    bad = [name for name, values in data.items() if not np.isfinite(values).all()]
    return f"{', '.join(bad)}: not finite" if bad else ""
