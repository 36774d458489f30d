"""Command lines: every option with values that are known to be right or wrong; what is wrong must be refused."""

import shutil
from pathlib import Path

import numpy as np

from tests.campaign.files import prepared
from tests.campaign.verdict import ACCEPTED, REFUSED, WRONG, Verdict, ask, judged

__all__ = ["command_case"]

NO_NUMBER = ("nan", "inf", "-inf", "text", "", "1e400", "1,2", "0x10", "9" * 400)
BAD_FILE = ("missing.h5", ".", "/dev/null", "job.toml", "bar.msh", "x" * 300, "/dev/zero", "a\nb")
FOLDERLESS = ("missing/out{0}", ".", "/proc/none{0}")
#: command -> option -> (right values, wrong values); "" stands for the argument
COMMANDS: dict[tuple[str, ...], dict[str, tuple[tuple[str, ...], tuple[str, ...]]]] = {
    ("cms", "info"): {
        "": (("modal.h5",), (*BAD_FILE, "results.h5", "system.toml")),
        "--units": (("m-kg-s", "mm-t-s"), ("mm", "", "furlong", "x" * 3000)),
    },
    ("cms", "frame"): {
        "": (("modal.h5",), (*BAD_FILE, "results.h5")),
        "--to": (("tisserand", "buckens"), ("", "nodall", "x" * 3000, "nodal")),
        "--origin": (("0,0,0",), ("0,0", "a,b,c", "nan,0,0", "inf,0,0", "", "1e400,0,0")),
        "--axes": (
            ("1,0,0;0,1,0;0,0,1",),
            ("1,0,0", "0,0,0;0,0,0;0,0,0", "1,0,0;1,0,0;0,0,1", "nan,0,0;0,1,0;0,0,1", ""),
        ),
        "--damping": (("0.02", "0"), ("-1", *NO_NUMBER)),
        "-o": (("out.h5",), (*tuple(each.format(".h5") for each in FOLDERLESS), "modal.h5")),
    },
    ("cms", "frf"): {
        "": (("modal.h5",), (*BAD_FILE, "results.h5")),
        "--from": (("left",), ("lft", "", "x" * 3000)),
        "--to": (("right",), ("rght", "", "x" * 3000)),
        "--band": (
            ("100:1000:5",),
            (
                "1000:100",
                "0:10",
                "-1:10",
                "10:20:1",
                "10:20:1000000000",
                "10",
                "a:b",
                "nan:10",
                "10:inf",
                "10:20:" + "9" * 400,
                "",
                "10:20:30:40",
            ),
        ),
        "--damping": (("0.02",), ("-1", *NO_NUMBER)),
        "-o": (("out.csv",), (*tuple(each.format(".csv") for each in FOLDERLESS), "out.h5", "out")),
    },
    ("cms", "check"): {
        "": (("modal.h5",), (*BAD_FILE, "results.h5")),
        "--band": (("500",), ("-5", "0", *NO_NUMBER)),
    },
    ("cms", "reduce"): {
        "": (("job.toml",), ("missing.toml", ".", "modal.h5", "/dev/null", "system.toml", "bar.msh", "x" * 300)),
        "-o": (("out.h5",), (*tuple(each.format(".h5") for each in FOLDERLESS), "bar.msh", "job.toml")),
    },
    ("floatframe", "info"): {"": (("results.h5", "system.toml", "half.h5.segments"), (*BAD_FILE, "modal.h5"))},
    ("floatframe", "export"): {
        "": (("results.h5",), (*BAD_FILE, "modal.h5", "system.toml")),
        "--every": (("1", "7"), ("0", "-1", "1.5", *NO_NUMBER)),
        "-o": (
            ("out.csv",),
            (*tuple(each.format(".csv") for each in FOLDERLESS), "out.xyz", "results.h5", "system.toml"),
        ),
    },
    ("floatframe", "run"): {
        "": (("system.toml",), ("missing.toml", ".", "results.h5", "/dev/null", "job.toml", "x" * 300)),
        "-o": (("out.h5",), (*(each.format(".h5") for each in FOLDERLESS), "system.toml", "/dev/stdout", "/dev/null")),
    },
    ("floatframe", "resume"): {
        "": (("system.toml",), ("missing.toml", ".", "results.h5", "job.toml")),
        "-o": ((), ("results.h5", "half.h5", "nothing.h5", "/dev/null", "missing/out.h5", "half.h5.segments")),
    },
    ("floatframe", "modes"): {
        "": (("system.toml",), ("missing.toml", ".", "results.h5", "/dev/null", "job.toml")),
        "--speed": (("0",), NO_NUMBER),
        "--axis": (("z", "0,0,1"), ("", "w", "0,0,0", "1,2", "nan,0,0", "a,b,c")),
        "--center": (("0,0,0",), ("", "0", "nan,0,0", "a,b,c")),
        "--modes": (("3",), ("1.5", *NO_NUMBER)),
    },
    ("floatframe", "campbell"): {
        "": (("system.toml",), ("missing.toml", ".", "results.h5", "job.toml")),
        "--speeds": (
            (),
            ("0:1", "0:1:0", "a:b:c", "0:1:1000000000", "nan:1:3", "0:inf:3", "", "0:1:-3", "0:1:" + "9" * 400),
        ),
        "-o": (("out.csv",), (*tuple(each.format(".csv") for each in FOLDERLESS), "out.xyz", "system.toml")),
    },
}


def command_case(seed: int, folder: Path) -> Verdict:
    """Take a command with one wrong value, or (one time in eight) none."""
    rng, whole = np.random.default_rng([7, seed]), prepared(folder.parent / "prepared")
    shutil.copytree(whole, folder, dirs_exist_ok=True)
    names = [*COMMANDS]
    command = names[seed % len(names)]
    options = COMMANDS[command]
    right = {option: str(rng.choice(values)) for option, (values, _) in options.items() if values}
    wrong = [option for option, (_, values) in options.items() if values]
    victim = wrong[int(rng.integers(len(wrong)))]
    is_wrong = rng.random() > 0.125 or any(not values for values, _ in options.values())
    if is_wrong:
        bad = options[victim][1]
        right = {option: value for option, value in right.items()} | {victim: bad[int(rng.integers(len(bad)))]}
    words = [*command[1:]]
    for option, value in right.items():
        takes_place = value.startswith("/") or option not in ("", "-o", "-j")
        value = value if takes_place else str(folder / value)
        words += [value] if option == "" else [f"{option}={value}"] if option.startswith("--") else [option, value]
    before = {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    reply = ask(command[0], *words)
    if command == ("cms", "check") and reply.code == 1 and not reply.fault and "verdict" in reply.stdout.lower():
        return Verdict(ACCEPTED, "a judgement")
    verdict = judged(reply, folder=folder)
    changed = [path.name for path, data in before.items() if not path.is_file() or path.read_bytes() != data]
    if changed:
        return Verdict(WRONG, f"{' '.join(words)[:300]}: changed {', '.join(changed)}")
    if verdict.kind == ACCEPTED and is_wrong:
        return Verdict(WRONG, f"{' '.join(words)[:300]}: accepted")
    if verdict.kind == REFUSED and not is_wrong:
        return Verdict(WRONG, f"{' '.join(words)[:300]}: refused what is right: {verdict.words}")
    return Verdict(verdict.kind, f"{' '.join(words)[:200]}: {verdict.words}")
