"""Mutants: change one line of physics at random, and see whether the tests that guard its module notice.

    python -m tests --mutants 60 --seed 5                  60 mutants, as many in each wing of `WINGS`
    python -m tests --mutants 20 --seed 5 --wings signals recovery
    python -m tests --mutants 60 --seed 5 --list           the changes alone, nothing is run

1. The lines of physics of a wing are those on which `Changes` finds arithmetic on numbers or arrays. Left out by rule:
   messages, checks that raise, defaults, text, tolerances (a name of `LIMITS`, or a number below 1e-3), and what
   bounds memory.
2. A line is drawn at random, then one of its changes: another operator, sign, constant, index, or a dropped term.
3. A copy of the checkout with that line runs the test files that guard the module (`guards`), at most `--guards` of
   them: those first whose path shares most words with the path of the module, or half as much with the paths of those
   in its folder that import it; then those with fewest imports between.
4. The first test that fails catches the mutant, provided that the same test passes without the change. A mutant that
   passes all has survived: it is a hole in the tests, or the change means the same, which only a reader can judge. One
   that takes longer than `LIMIT` counts as survived.

The exit code is 0 if at least `SHARE` of the mutants are caught. A mutant takes about half a minute.
"""

import argparse
import ast
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import accumulate
from pathlib import Path

from tests.import_graph import all_uses, guards, imported_modules, module_name, modules
from tests.root import ROOT

__all__ = ["WINGS", "Mutant", "draw", "main", "physics"]

WINGS = {  # name -> files and folders
    "importers": ("fe_models/files", "cms/exchange/importers", "floatframe/files/importers"),
    "shaking": ("floatframe/durability/shaking",),
    "signals": ("floatframe/files/signals",),
    "recovery": (
        "cms/reduction/recovery", "cms/body/stress.py", "cms/body/recovery_table.py", "fe_models/elements/recovery",
        "floatframe/results",
    ),
    "components": ("floatframe/components",),
}  # fmt: skip
SHARE = 0.85
LIMIT = 400.0  #: seconds of the tests of a mutant
PRINTED = re.compile(r"page|chart|report|head|export|writer|formats|ledger|record|__init__")  #: files that show or keep
PRINTS = re.compile(r"^(?:description|describe|words|notes|__repr__|__str__)|_(?:words|notes)$")  #: functions that do
LIMITS = re.compile(  # words of names that bound errors, sizes or memory
    r"(?:^|_)(?:tol|tolerance|rtol|atol|eps|rounding|roundoff|digits|accuracy|least|most|few|chunk|bytes|nbytes|"
    r"itemsize|offset|memory|workers)(?:_|$)",
    re.IGNORECASE,
)
TOLD = re.compile(r"(?:Error|Warning|[wW]arn|warning|info|debug|note|notes|log|print|format|join|isclose|allclose)$")
CONSTANT = re.compile(r"^([A-Z][A-Z0-9_]*)\b[^=\n]*= *(\d[\d.]*(?:e[-+]?\d+)?)\b", re.MULTILINE)
SMALL = 1e-3
PATHS = re.compile(r"(?:^|_)(?:path|folder|root|file|directory|name)$", re.IGNORECASE)
OTHER = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*"}
ARITHMETIC = (*OTHER, ast.MatMult, ast.Pow)


@dataclass(frozen=True)
class Mutant:
    """A change of one line: in `path`, the bytes from `start` to `end` become `new`."""

    path: Path
    line: int
    start: int
    end: int
    new: str

    def text(self) -> str:
        """Return the source with the change."""
        source = self.path.read_bytes()
        return (source[: self.start] + self.new.encode() + source[self.end :]).decode()

    def __str__(self) -> str:
        old, new = self.path.read_text().splitlines(), self.text().splitlines()
        n = self.line - 1
        return f"{self.path.relative_to(ROOT)}:{self.line}\n  - {old[n].strip()}\n  + {new[n].strip()}"


class Changes(ast.NodeVisitor):
    """Collects the changes of each line of physics in a file (step 1)."""

    def __init__(self, path: Path):
        self.path, self.source = path, path.read_bytes()
        self.starts = [0, *accumulate(map(len, self.source.splitlines(keepends=True)))]  # of lines, in bytes
        self.found: dict[int, list[Mutant]] = {}
        known = (path, *(modules()[name] for name in imported_modules(path) & modules().keys()))
        self.small = frozenset().union(*map(small_constants, known))
        self.visit(ast.parse(self.source))

    def places(self, node) -> tuple[int, int]:
        start, end = self.starts[node.lineno - 1], self.starts[node.end_lineno - 1]
        return start + node.col_offset, end + node.end_col_offset

    def words(self, node) -> str:
        start, end = self.places(node)
        return self.source[start:end].decode()

    def add(self, node, new: str) -> None:
        if node.lineno == node.end_lineno:
            self.found.setdefault(node.lineno, []).append(Mutant(self.path, node.lineno, *self.places(node), new))

    # what is no physics ----------------------------------------------------------------------------------------------

    def visit_Module(self, node):
        for inner in ast.walk(node):
            if isinstance(inner, ast.FunctionDef) and not PRINTS.search(inner.name):
                self.statements(inner.body)

    def statements(self, body) -> None:
        for statement in body:
            if isinstance(statement, ast.FunctionDef | ast.ClassDef | ast.Raise | ast.Assert):
                continue  # functions inside have their own turn
            blocks = [getattr(statement, name) for name in ("body", "orelse", "finalbody") if hasattr(statement, name)]
            if not blocks:
                if not is_limit(statement, self.small):
                    self.visit(statement)
                continue
            raises = isinstance(statement, ast.If) and isinstance(statement.body[-1], ast.Raise)
            for name in () if raises else ("test", "iter"):
                if (part := getattr(statement, name, None)) is not None and not is_limit(part, self.small):
                    self.visit(part)
            for block in (*blocks, *(handler.body for handler in getattr(statement, "handlers", ()))):
                self.statements(block)

    def visit_AnnAssign(self, node):
        if node.value is not None:
            self.visit(node.value)

    def visit_Lambda(self, node):
        self.visit(node.body)

    def visit_JoinedStr(self, node):
        pass

    def visit_Call(self, node):
        if not TOLD.search(name_of(node.func)):
            self.generic_visit(node)

    def visit_keyword(self, node):
        if not LIMITS.search(node.arg or "") and node.arg not in ("dtype", "axis", "first_line", "stacklevel"):
            self.visit(node.value)

    # what is physics -------------------------------------------------------------------------------------------------

    def visit_BinOp(self, node):
        if not isinstance(node.op, ARITHMETIC) or is_text(node.left) or is_text(node.right):
            return
        left, right, op = self.words(node.left), self.words(node.right), type(node.op)
        if op in OTHER:
            self.add(node, f"(({left}) {OTHER[op]} ({right}))")
        if op in (ast.Add, ast.Sub):
            self.add(node, f"({left})")
        if op is ast.MatMult:
            self.add(node, f"(-(({left}) @ ({right})))")
        if op is ast.Pow:
            self.add(node, f"(({left}) ** (({right}) + 1))")
        for side in (node.left, node.right):
            if is_number(side):
                self.add(side, str(side.value + 1) if isinstance(side.value, int) else repr(1.1 * side.value))
        self.generic_visit(node)

    def visit_AugAssign(self, node):
        if type(node.op) in OTHER and not is_text(node.value):
            left, right = self.words(node.target), self.words(node.value)
            self.add(node, f"{left} {OTHER[type(node.op)]}= {right}")
        self.visit(node.value)

    def visit_UnaryOp(self, node):
        if isinstance(node.op, ast.USub) and not is_number(node.operand):
            self.add(node, f"({self.words(node.operand)})")
        self.visit(node.operand)

    def visit_Subscript(self, node):
        """An index counts where the line does arithmetic besides."""
        self.visit(node.value)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        for index in indices:
            if is_number(index) and node.lineno in self.found:
                self.add(index, str(index.value - 1 if index.value else 1))
            elif not is_number(index):
                self.visit(index)


def name_of(node) -> str:
    """Return the last word of a name such as `np.linalg.norm`."""
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def is_number(node) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def is_text(node) -> bool:
    """Return whether a side of an operator is text, a path or a list: `"a" + b`, `folder / name`, `[0] * 6`."""
    if isinstance(node, ast.BinOp):
        return is_text(node.left) or is_text(node.right)
    if isinstance(node, ast.Call):
        return name_of(node.func) == "Path"
    if isinstance(node, ast.Constant):
        return isinstance(node.value, str | bytes)
    return isinstance(node, ast.JoinedStr | ast.List | ast.Tuple | ast.ListComp) or bool(PATHS.search(name_of(node)))


def is_limit(statement, small: frozenset[str]) -> bool:
    """Return whether a statement is about a tolerance or memory: by its names, a number below 1e-3, or its name."""
    for node in ast.walk(statement):
        if is_number(node) and 0 < abs(node.value) < SMALL:
            return True
        if LIMITS.search(name_of(node)) or name_of(node) in small:
            return True
    return False


@cache
def small_constants(path: Path) -> frozenset[str]:
    """Return the constants of a module that are numbers below 1e-3, such as `SAME = 1e-9`."""
    found = CONSTANT.findall(path.read_text(encoding="utf-8"))
    return frozenset(name for name, value in found if 0 < float(value) < SMALL)


def physics(wing: str) -> list[list[Mutant]]:
    """Return the changes of each line of physics of a wing."""
    found = []
    for place in WINGS[wing]:
        for path in sorted((ROOT / place).rglob("*.py")) if not place.endswith(".py") else [ROOT / place]:
            if not PRINTED.search(path.stem):
                found += [changes for _, changes in sorted(Changes(path).found.items())]
    return found


def draw(n_mutants: int, seed: int, wings: tuple[str, ...]) -> Iterator[tuple[str, Mutant]]:
    """Yield mutants of different lines, wing by wing in turn (step 2)."""
    rng = random.Random(seed)
    left = {wing: rng.sample(lines, len(lines)) for wing in wings for lines in [physics(wing)]}
    for k in range(n_mutants):
        wing = wings[k % len(wings)]
        yield wing, rng.choice(left[wing].pop())


# the tests ------------------------------------------------------------------------------------------------------------


COMMON = {"test", "fe", "model", "cm", "floatframe", "file", "py"}  #: words of so many paths that they say little


def words_of(path: str) -> set[str]:
    """Return the words of a path, without plurals and those of `COMMON`."""
    return {word.rstrip("s") for word in re.split(r"[/_.]", path)} - {
        "test",
        "fe",
        "model",
        "cm",
        "floatframe",
        "file",
        "py",
    }


@cache
def guarding_files(path: Path, n_files: int) -> list[str]:
    """Return the test files of a module in the order of step 3."""
    name = module_name(path)
    steps = guards([name])
    files = [file for file in steps if not file.startswith(("tests/docs", "tests/external"))]
    users = [modules()[user] for user, used in all_uses().items() if name in used and user in modules()]
    near = [str(user.relative_to(ROOT)) for user in users if user.is_relative_to(path.parent)]
    of_users = frozenset().union(*map(words_of, near))
    own = words_of(str(path.relative_to(ROOT)))

    def order(file: str) -> tuple[float, int, str]:
        shared = words_of(file) & (own | of_users)
        return -sum(1.0 if word in own else 0.5 for word in shared), steps[file], file

    return sorted(files, key=order)[:n_files]


def failing_test(copy: Path, tests: list[str]) -> str | None:
    """Run tests in a copy; return the first that fails, "" if none does, None if they take too long."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", "not long and not external"]
    env = {"OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg", **os.environ, "PYTHONPATH": str(copy)}
    process = subprocess.Popen(
        [*command, *tests], cwd=copy, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        start_new_session=True,
    )  # fmt: skip
    try:
        told = process.communicate(timeout=LIMIT)[0]
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return None
    failed = re.findall(r"^(?:FAILED|ERROR) (\S+?\.py(?:::[^\n]*?)?)(?: - .*)?$", told, re.MULTILINE)
    return (failed[0] if failed else tests[0]) if process.returncode else ""


@dataclass
class Bench:
    """The checkout without a change in `clean`; each mutant has a copy of it."""

    clean: Path
    sound: dict[str, bool]  #: test -> whether it passes without a change

    def judge(self, mutant: Mutant, n_files: int) -> tuple[str, str]:
        """Return what became of a mutant and the test that tells (steps 3 and 4)."""
        files = guarding_files(mutant.path, n_files)
        with tempfile.TemporaryDirectory() as folder:
            copy = Path(shutil.copytree(self.clean, Path(folder, "copy"), symlinks=True, copy_function=os.link))
            (changed := copy / mutant.path.relative_to(ROOT)).unlink()  # else the clean file, the same on disk, changes
            changed.write_text(mutant.text(), encoding="utf-8")
            test = failing_test(copy, files) if files else ""
        if test is None:
            return "survived", f"after {LIMIT:g} s"
        if test and test not in self.sound:
            self.sound[test] = failing_test(self.clean, [test]) == ""
        if test and not self.sound[test]:
            return "unsound", f"{test} fails without the change"
        return ("caught", test) if test else ("survived", f"{len(files)} files: {' '.join(files[:3])} ...")


def main(words: list[str]) -> int:
    """Draw mutants, judge them, print each and the shares; return 0 if enough are caught."""
    parser = argparse.ArgumentParser(prog="python -m tests --mutants", description=__doc__.splitlines()[0])
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--wings", nargs="+", choices=WINGS, default=list(WINGS))
    parser.add_argument("--guards", type=int, default=8, help="test files for a mutant at most")
    parser.add_argument("--list", action="store_true", help="print the mutants, run nothing")
    given = parser.parse_args(words)
    counts: dict[str, Counter[str]] = {wing: Counter() for wing in given.wings}
    with tempfile.TemporaryDirectory() as folder:
        ignored = shutil.ignore_patterns(".*", "build", "*.egg-info")
        bench = Bench(Path(folder, "clean"), {})
        if not given.list:
            shutil.copytree(ROOT, bench.clean, symlinks=True, ignore=ignored)
        for k, (wing, mutant) in enumerate(draw(given.count, given.seed, tuple(given.wings))):
            kind, why = ("listed", "") if given.list else bench.judge(mutant, given.guards)
            counts[wing][kind] += 1
            print(f"{k:3d} {wing}: {kind} {why}\n  {mutant}", flush=True)
    total = sum(counts.values(), Counter())
    for wing, count in [*counts.items(), ("all", total)]:
        print(f"{wing}: {', '.join(f'{n} {kind}' for kind, n in sorted(count.items()))}")
    return int(total["caught"] < SHARE * given.count)
