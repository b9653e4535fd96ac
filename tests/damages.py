"""What happens to a file on its way: each function damages bytes in its own manner, drawn from a generator."""

from __future__ import annotations

import re


def truncated(rng, content):
    return content[: rng.integers(0, len(content))]


def beheaded(rng, content):
    return content[rng.integers(0, len(content)) :]


def shuffled_bytes(rng, content):
    data = bytearray(content)
    at = rng.integers(0, len(data), rng.integers(2, 40))
    picked = [data[one] for one in at]
    rng.shuffle(picked)
    for one, byte in zip(at, picked, strict=True):
        data[one] = byte
    return bytes(data)


def random_bytes(rng, content):
    data = bytearray(content)
    for at in rng.integers(0, len(data), rng.integers(1, 20)):
        data[at] = rng.integers(0, 256)
    return bytes(data)


def a_piece_lost(rng, content):
    start, stop = sorted(rng.integers(0, len(content), 2))
    return content[:start] + content[stop:]


def a_piece_twice(rng, content):
    start, stop = sorted(rng.integers(0, len(content), 2))
    return content[:stop] + content[start:]


def shuffled_lines(rng, content):
    rows = content.splitlines(keepends=True)
    rng.shuffle(rows)
    return b"".join(rows)


def other_separators(rng, content):
    table = bytes.maketrans(b",;.\t", bytes(rng.choice(list(b",;.\t |:"), 4).tolist()))
    part = rng.integers(0, len(content))
    return content.translate(table) if rng.random() < 0.5 else content[:part] + content[part:].translate(table)


def swapped_columns(rng, content):
    rows = []
    for row in content.split(b"\n"):
        parts = re.split(rb"([;,\t\r])", row)
        for at in range(0, len(parts) - 2, 4):
            if parts[at] and parts[at + 2] and parts[at + 1] != b"\r":
                parts[at], parts[at + 2] = parts[at + 2], parts[at]
        rows.append(b"".join(parts))
    return b"\n".join(rows)


def huge_numbers(rng, content):
    cells = re.split(rb"([;,\t\r\n])", content)
    for at in rng.integers(0, len(cells), 5):
        cells[at] = [b"1e308", b"-9e99999", b"9" * 400, b"1e-400", b"nan", b"inf", b"0x7f", b"1e", b"--1"][
            rng.integers(9)
        ]
    return b"".join(cells)


def empty(rng, content):
    return bytes(rng.choice(list(b" \t\r\n;,"), rng.integers(0, 50)).tolist())


def binary(rng, content):
    return rng.bytes(rng.integers(1, 5000))


DAMAGES = [
    truncated,
    beheaded,
    shuffled_bytes,
    random_bytes,
    a_piece_lost,
    a_piece_twice,
    shuffled_lines,
    other_separators,
    swapped_columns,
    huge_numbers,
    empty,
    binary,
]


def nested(rng, content):
    """Brackets, keys or tags far deeper than any file has them."""
    at, depth = rng.integers(0, len(content) + 1), int(rng.integers(100, 30_000))
    deep = [b"[", b"{", b"a.", b'{"a":', b"<a>", b"(", b"[["][rng.integers(7)] * depth
    return content[:at] + deep + content[at:]


def huge_figures(rng, content):
    """Numbers of hundreds and thousands of digits, or none, in place of some that are there."""
    figures = list(re.finditer(rb"[0-9.]+", content))
    data = bytearray(content)
    for at in sorted(rng.integers(0, len(figures), 3), reverse=True) if figures else []:
        digits = [b"9" * 400, b"9" * 6000, b"1e999", b"-1", b"nan", b"0", b"1e-999", b"1_000", b"9223372036854775808"]
        data[figures[at].start() : figures[at].end()] = digits[rng.integers(len(digits))]
    return bytes(data)


def long_lines(rng, content):
    """A line repeated without its end."""
    rows = content.splitlines(keepends=True) or [b""]
    at = rng.integers(0, len(rows))
    most = 2_000_000 // (len(rows[at]) + 1)
    rows[at] = rows[at].strip() * int(rng.integers(1, max(2, min(3000, most)))) + b"\n"
    return b"".join(rows)


def signs_for_terminals(rng, content):
    """Escape sequences, line breaks and marks that turn the direction of text, where names and cells stand."""
    data = bytearray(content)
    for _ in range(rng.integers(1, 8)):
        at = rng.integers(0, len(data) + 1)
        sign = [b"\x1b[2J", b"\x1b]0;a\x07", b"\r", "\u202e".encode(), "\x9b".encode(), "\u2028".encode(), b"\x08" * 9]
        data[at:at] = sign[rng.integers(len(sign))]
    return bytes(data)


def long_runs(rng, content):
    """One sign many times over, within a line: what a careless pattern takes the square of the time for."""
    at, times = rng.integers(0, len(content) + 1), int(rng.integers(1_000, 200_000))
    sign = [b" ", b"9", b"0", b"-", b".", b"e", b'"', b"(", b"[x]", b"a ", b"_N", b"#", b"\t", b"1 ", b"a/", b"' "]
    return content[:at] + sign[rng.integers(len(sign))] * times + content[at:]


ALL_DAMAGES = [*DAMAGES, nested, huge_figures, long_lines, long_runs, signs_for_terminals]
