"""What `python -m benchmarks` keeps of its runs: figures, those of the last run beside them, and a page of both.

A benchmark takes part by a function `figures(short: bool) -> dict[str, float]` in its module. A name that ends in a
unit in brackets belongs to this machine, the others are ratios. Smaller is better, but for names that end in "speedup"
or "saving".
"""

import ast
import json
import os
import platform
import re
import subprocess
import sys
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from benchmarks.aims import AIMS, Aim

FOLDER = Path(__file__).parent
ROOT = FOLDER.parent
RESULTS = FOLDER / "results.json"  #: of the last run that was kept
PAGE = ROOT / "docs" / "figures.md"
WORSE = 1.15  #: a ratio that grows by more is a regression
MORE_IS_BETTER = ("speedup", "saving")  #: ends of the names of figures
PACKAGES = ("numpy", "scipy", "numba", "pypardiso", "mkl", "exudyn", "pin")
#: a number in a text, and the figure of a benchmark that it quotes
QUOTED = re.compile(r"(?P<number>-?\d+(?:\.\d+)?)<!-- *(?P<module>\w+): (?P<name>[^>]*?) *-->")
HEAD = """# Figures of the last run

Written by `python -m benchmarks --keep`, which measures all that is short, each benchmark in a process of its own; do
not edit. Ratios are of one run and bear a comparison between machines, figures with a unit do not. Smaller is better,
but for speedups and savings. Longer studies, and what the figures mean: [benchmarks](project/benchmarks.md).
"""
RECORD = "FIGURES "  #: begins the line in which a benchmark's process tells them


@dataclass(frozen=True)
class Results:
    """Figures of one run of the watch."""

    commit: str
    date: str
    machine: dict[str, str]
    load: float  #: of the machine before the run began, in processes
    figures: dict[str, dict[str, float]]  #: of each module
    seconds: dict[str, float]  #: each module took, by the clock
    failed: dict[str, str] = field(default_factory=dict)  #: last line of what a module said
    renewed: list[str] = field(default_factory=list)  #: modules of this run, if the others are of earlier runs

    @classmethod
    def read(cls, path: Path) -> "Results | None":
        """Return what was kept, None if nothing was."""
        return cls(**json.loads(path.read_text())) if path.is_file() else None

    def write(self, path: Path) -> None:
        """Write JSON, whole or not at all."""
        part = path.with_suffix(".part")
        part.write_text(json.dumps(asdict(self), indent=1, ensure_ascii=False) + "\n")
        part.replace(path)


@dataclass(frozen=True)
class Change:
    """A figure beside that of an earlier run."""

    module: str
    name: str
    now: float
    last: float | None

    @property
    def is_ratio(self) -> bool:
        """Whether the figure is a ratio of one run, which bears a comparison between machines."""
        return not self.name.endswith("]")

    @property
    def is_more_better(self) -> bool:
        """Whether more is better."""
        return self.name.endswith(MORE_IS_BETTER)

    @property
    def worse(self) -> float:
        """How many times worse than the earlier run; 1 where there is none."""
        if self.last is None or not self.last > 0 or not self.now > 0:
            return 1.0
        grown = self.now / self.last
        return 1 / grown if self.is_more_better else grown

    @property
    def words(self) -> str:
        """By how much the figure changed."""
        if not self.last:
            return ""
        change = f"{100 * (self.now / self.last - 1):+.0f} %"
        return f"{change} **regression**" if self.is_regression else change

    @property
    def is_regression(self) -> bool:
        """Whether a ratio became worse by more than `WORSE`."""
        return self.is_ratio and self.worse > WORSE


def modules() -> list[str]:
    """Return the benchmarks that take part, by name: those with a function `figures`."""
    found = []
    for path in sorted(FOLDER.glob("*.py")):
        functions = (each for each in ast.parse(path.read_text()).body if isinstance(each, ast.FunctionDef))
        if any(each.name == "figures" for each in functions):
            found.append(path.stem)
    return found


def title(module: str) -> str:
    """Return the first sentence of what a benchmark says of itself."""
    told = ast.get_docstring(ast.parse((FOLDER / f"{module}.py").read_text())) or module
    return " ".join(told.split("\n\n")[0].split())


def measured(module: str, *, short: bool, limit: float) -> dict[str, float]:
    """Return the figures of a benchmark, measured in a process of its own.

    Raises
    ------
    RuntimeError
        If it fails, takes longer than `limit` [s] or tells no figures: the last line of what it said.
    """
    code = (
        f"import json, benchmarks.{module} as made; "
        f"print({RECORD!r} + json.dumps({{k: float(v) for k, v in made.figures({short}).items()}}))"
    )
    try:
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=limit
        )
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"no answer within {limit:.0f} s") from None
    for line in done.stdout.splitlines():
        if line.startswith(RECORD):
            return json.loads(line.removeprefix(RECORD))
    said = (done.stderr.strip() or done.stdout.strip() or f"exit status {done.returncode}").splitlines()
    raise RuntimeError(said[-1])


def this_machine() -> dict[str, str]:
    """Return what tells this machine and its libraries from others."""
    processor = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        named = (line.split(":")[1].strip() for line in info.read_text().splitlines() if "model name" in line)
        processor = next(named, processor)
    told = {"processor": processor, "processors": str(os.cpu_count()), "Python": platform.python_version()}
    for package in PACKAGES:
        try:
            told[package] = version(package)
        except PackageNotFoundError:
            told[package] = "not installed"
    return told


def commit() -> str:
    """Return the commit of this tree, with a + if files differ from it."""
    said = subprocess.run(["git", "describe", "--always", "--dirty=+"], cwd=ROOT, capture_output=True, text=True)
    return said.stdout.strip() or "unknown"


def changes(now: Results, last: Results | None) -> list[Change]:
    """Return all figures of a run beside those of an earlier one."""
    before = last.figures if last else {}
    return [
        Change(module, name, value, before.get(module, {}).get(name))
        for module, figures in now.figures.items()
        for name, value in figures.items()
    ]


def shown(value: float | None) -> str:
    """Return a figure with three digits."""
    if value is None:
        return "–"
    return f"{value:.3g}" if value == 0 or 1e-3 <= abs(value) < 1000 else f"{value:.2e}"


def aims_table(now: Results, aims: tuple[Aim, ...]) -> list[str]:
    """Return the lines of the table of aims: figures of this run, and why aims are missed."""
    lines = ["## Aims", "", "| figure | now | aim | |", "|---|---|---|---|"]
    for aim in aims:
        value = now.figures.get(aim.module, {}).get(aim.name)
        if value is None:
            told = "not measured"
        elif aim.is_met(value, more_is_better=aim.name.endswith(MORE_IS_BETTER)):
            told = "reached"
        else:
            told = f"**missed**: {aim.reason}"
        lines.append(f"| {aim.name} (`{aim.module}`) | {shown(value)} | {shown(aim.value)} | {told} |")
    return [*lines, ""]


def page(now: Results, last: Results | None) -> str:
    """Return the page of figures."""
    told = changes(now, last)
    machine = f"{now.machine['processors']} processors ({now.machine['processor']})"
    lasted = f"load {now.load:.1f} before it began, {sum(now.seconds.values()) / 60:.1f} min"
    lines = [
        HEAD,
        f"Now: {now.date}, commit `{now.commit}`, {machine}, {lasted}.",
        f"Last: {last.date}, commit `{last.commit}`, load {last.load:.1f}." if last else "There was no run before.",
        *([f"Of this run: {', '.join(now.renewed)}; the others are of earlier runs."] if now.renewed else []),
        "Libraries: " + ", ".join(f"{name} {now.machine[name]}" for name in ("Python", *PACKAGES)) + ".",
        "",
        *aims_table(now, AIMS),
    ]
    for module in now.figures:
        lines += [f"## {title(module).rstrip('.')}", "", f"`benchmarks/{module}.py`, {now.seconds[module]:.0f} s", ""]
        lines += ["| figure | now | last | change |", "|---|---|---|---|"]
        for each in told:
            if each.module == module:
                lines.append(f"| {each.name} | {shown(each.now)} | {shown(each.last)} | {each.words} |")
        lines.append("")
    if now.failed:
        lines += ["## Not measured", "", *(f"- `{module}`: {said}" for module, said in now.failed.items()), ""]
    return "\n".join(lines)


def texts() -> list[Path]:
    """Return the texts that may quote figures."""
    return [ROOT / "README.md", FOLDER / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def as_quoted(value: float, like: str) -> str:
    """Return a figure with as many decimals as the number it takes the place of."""
    decimals = len(like.partition(".")[2])
    return f"{value:.{decimals}f}"


def quote(results: Results) -> list[Path]:
    """Renew the figures quoted in texts; returns the texts that changed."""
    changed = []
    for path in texts():
        text = path.read_text()

        def renewed(match: re.Match) -> str:
            value = results.figures.get(match["module"], {}).get(match["name"])
            if value is None:  # not measured this time: what stands there was, by an earlier run
                return match[0]
            return as_quoted(value, match["number"]) + match[0][len(match["number"]) :]

        new = QUOTED.sub(renewed, text)
        if new != text:
            path.write_text(new)
            changed.append(path)
    return changed
