"""Seeded damage to text and bytes."""

import re

import numpy as np

__all__ = ["damaged_bytes", "damaged_text", "damaged_toml"]

Rng = np.random.Generator
NUMBER = re.compile(r"(?<![\w.\"])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.\"])")
TEXT = re.compile(r'"[^"\n]*"')
WILD_NUMBERS = (
    "-1", "0", "-0.0", "1e-300", "1e308", "1e101", "1e99", "nan", "inf", "-inf", "true", '"text"', "[]", "{}", "[[1]]",
    "1" + "0" * 400, "9" * 5000, "9223372036854775808", "1e-12", "1979-05-27", "0x10", "1_000", "'", "1e9", "-2.5", "7",
)  # fmt: skip
WILD_TEXTS = ('""', '"\\u0000"', '"' + "x" * 3000 + '"', '"../../etc/passwd"', '"ä\\u202e"', '" "', "3", "true", "[]",
              '"nodes"', '"rigid"', '"."', '"/dev/zero"', '"/"')  # fmt: skip


def damaged_toml(text: str, rng: Rng) -> bytes:
    """Return a TOML text with one to three faults, some of which leave it valid with other numbers."""
    for _ in range(int(rng.integers(1, 4))):
        kind = int(rng.integers(12))
        if kind < 3:
            text = replaced(text, NUMBER, rng, lambda old: str(rng.choice(WILD_NUMBERS)))
        elif kind < 5:
            text = replaced(text, NUMBER, rng, lambda old: scaled(old, rng))
        elif kind == 5:
            text = replaced(text, TEXT, rng, lambda old: str(rng.choice(WILD_TEXTS)))
        elif kind == 6:
            others = TEXT.findall(text)
            text = replaced(text, TEXT, rng, lambda old, others=others: str(rng.choice(others)))
        elif kind == 7:
            text = replaced(text, re.compile(r"[a-z_]{3,}"), rng, lambda old: misspelt(old, rng))
        elif kind == 8:
            text = shuffled_lines(text, rng)
        elif kind == 9:
            n = int(rng.choice([5, 25, 3000]))
            text = replaced(text, NUMBER, rng, lambda old, n=n: "[" * n + "]" * n)
        elif kind == 10:
            text += str(
                rng.choice(["\n[more]\nkey = 1\n", "\nkey = 1\n", "\n[[run]]\n", "\x00", "\n# a remark\n", "\n]"])
            )
        else:
            return damaged_bytes(text.encode(), rng)
    return text.encode("utf-8", "surrogatepass")


def damaged_text(text: str, rng: Rng) -> bytes:
    """Return a table of numbers (a mesh) with one or two faults."""
    for _ in range(int(rng.integers(1, 3))):
        kind = int(rng.integers(9))
        if kind < 2:
            text = replaced(
                text, NUMBER, rng, lambda old: str(rng.choice([*WILD_NUMBERS[:12], "999", "1", "abc", "1e"]))
            )
        elif kind < 4:
            text = replaced(text, NUMBER, rng, lambda old: scaled(old, rng))
        elif kind == 4:
            text = replaced(text, re.compile(r"[A-Za-z$*]{3,}"), rng, lambda old: misspelt(old, rng))
        elif kind < 7:
            text = shuffled_lines(text, rng)
        elif kind == 7:
            text = text[: int(rng.integers(len(text)))]
        else:
            return damaged_bytes(text.encode(), rng)
    return text.encode()


def damaged_bytes(data: bytes, rng: Rng) -> bytes:
    """Return bytes of which some are changed, cut off, cut out, doubled or set to zero."""
    content, kind = bytearray(data), int(rng.integers(6))
    first = int(rng.integers(len(content)))
    length = int(rng.integers(1, 200))
    if kind == 0:
        del content[first:]
    elif kind == 1:
        del content[first : first + length]
    elif kind == 2:
        content[first:first] = content[first : first + length]
    elif kind == 3:
        content[first : first + length] = bytes(len(content[first : first + length]))
    else:
        for place in rng.integers(len(content), size=int(rng.integers(1, 5))):
            content[place] ^= int(rng.integers(1, 256))
    return bytes(content)


def replaced(text: str, what: re.Pattern[str], rng: Rng, new: object) -> str:
    """Return the text with one occurrence of a pattern replaced."""
    found = list(what.finditer(text))
    if not found:
        return text
    match = found[int(rng.integers(len(found)))]
    return text[: match.start()] + new(match[0]) + text[match.end() :]  # type: ignore[operator]


def scaled(number: str, rng: Rng) -> str:
    """Return a number a little larger or smaller; a whole one stays whole."""
    if re.fullmatch(r"[-+]?\d+", number):
        return str(int(number) + int(rng.integers(-2, 3)))
    return repr(float(number) * float(rng.uniform(0.5, 2.0)))


def misspelt(word: str, rng: Rng) -> str:
    """Return a word with a letter changed, doubled or left out."""
    k = int(rng.integers(len(word)))
    middle = (word[k] * 2, "", str(rng.choice(list("abcxyz_é"))))[int(rng.integers(3))]
    return word[:k] + middle + word[k + 1 :]


def shuffled_lines(text: str, rng: Rng) -> str:
    """Return the text with a line left out, doubled, or exchanged with another."""
    lines = text.split("\n")
    i, j = (int(k) for k in rng.integers(len(lines), size=2))
    kind = int(rng.integers(3))
    if kind == 0:
        del lines[i]
    elif kind == 1:
        lines.insert(j, lines[i])
    else:
        lines[i], lines[j] = lines[j], lines[i]
    return "\n".join(lines)
