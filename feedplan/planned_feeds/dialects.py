"""The dialects of controls, and the words of a program that each control does not understand."""

from __future__ import annotations

import re
from typing import Literal, get_args

DialectName = Literal["linuxcnc", "grbl", "fanuc"]
DIALECTS: tuple[DialectName, ...] = get_args(DialectName)


def _g(codes: str) -> bytes:
    return rb"[Gg][ \t]*0*(?:" + codes.encode() + rb")(?![\d.])"


def _m(codes: str) -> bytes:
    return rb"[Mm][ \t]*0*(?:" + codes.encode() + rb")(?![\d.])"


# Patterns of words, without comments, and their names in messages.
_SPLINES = (_g(r"5|5\.1|5\.2|5\.3"), "splines by G5, G5.1 and G5.2")
_NURBS = (_g(r"6\.2"), "NURBS by G6.2")
_FLOW = (rb"[Oo][ \t]*(?:<|\[|\d+[ \t]*[A-Za-z])", "O words of subroutines, loops and branches")
_NAMES = (rb"#[ \t]*<", "parameters with names")
_PARAMETERS = (rb"[#\[]", "parameters and expressions")
_TURNS = (_g("[23]") + rb"[^\r\n]*[Pp][ \t]*\d", "turns of an arc by P")
_BLEND = (_g("64") + rb"[^\r\n]*[Pp]", "a tolerance by G64 P")
_LACKS: dict[DialectName, tuple[tuple[bytes, str], ...]] = {
    "linuxcnc": (
        (_NURBS[0], "NURBS by G6.2, before its version 2.9"),
        (_g(r"6[5-8]|12|13|50|51|54\.1"), "macros, scaling and turned coordinates by these codes"),
        (rb",[ \t]*[CcRr]", "chamfers and roundings by ,C and ,R"),
        (_g(r"60|28\.2|28\.3|28\.4"), "these reference codes"),
    ),
    "grbl": (
        _SPLINES,
        _NURBS,
        _FLOW,
        _PARAMETERS,
        _TURNS,
        (_g(r"7[346]|8[1-9]|98|99|33|33\.1"), "canned cycles and threads"),
        (_g(r"41|42|41\.1|42\.1"), "cutter compensation"),
        (_g(r"95|96"), "feed per turn and constant surface speed"),
        (_g(r"64|61\.1"), "G64 and G61.1"),
        (_g(r"43|43\.2|43\.4|43\.5|52|15|16|7|8|10[^\r\n]*[Ll][ \t]*1\d?(?!\d)"), "these offsets and modes"),
        (_m(r"6|19|6[0-8]|7\d|9[789]|1\d\d"), "these M codes"),
        (rb"[ABCUVWabcuvw][ \t]*[-+.\d]", "axes beside X, Y and Z (grblHAL has some)"),
        (rb"(?<![^\r\n])[ \t]*/", "blocks after /"),
    ),
    "fanuc": (
        _SPLINES,
        _FLOW,
        _NAMES,
        _TURNS,
        _BLEND,
        (_g(r"61\.1|38\.\d|33\.1|43\.1|59\.\d|17\.1|18\.1|19\.1"), "these codes"),
        (_m(r"6[2-8]|7\d"), "digital outputs and saved modes by these M codes"),
        (rb"[@^]", "polar words by @ and ^"),
        (
            rb"[Gg][ \t]*0*(?:4|8[2689])(?![\d.])[^\r\n]*[Pp][ \t]*[.\d]",
            "seconds of a dwell by P, which it takes as milliseconds",
        ),
        (rb"[a-z]", "lower-case words"),
        (
            rb"[XYZABCUVWIJKR][ \t]*[-+]?\d+(?![\d.])",
            "lengths without a decimal point, unless a setting makes them whole units",
        ),
    ),
}
# The most characters of a line, without blanks and comments where these are not stored.
_LONGEST: dict[DialectName, int] = {"linuxcnc": 255, "grbl": 70, "fanuc": 250}
_NAMES_OF: dict[DialectName, str] = {"linuxcnc": "LinuxCNC", "grbl": "grbl", "fanuc": "Fanuc"}
# Words that are no longer in a program after it was written anew, and what replaces them.
_GONE = (
    (
        _g(r"43|43\.1|43\.2"),
        "is left out: the coordinates have the tool lengths that are known, 0 for others (a tool table gives "
        "them)",
    ),
    (
        _g(r"5[5-9]|59\.[1-3]|54\.1|154|10|52|92"),
        "is left out: the coordinates have the work offsets that are known, 0 for others (the machine file "
        "gives them)",
    ),
    (
        _g(r"33|33\.1|74|76|84"),
        "is written as plain moves at its feed, which do not follow the spindle: a tap needs a holder that "
        "gives way, and no thread can be cut so",
    ),
)
_GONE_IN: dict[DialectName, tuple[tuple[bytes, str], ...]] = {
    "linuxcnc": (),
    "grbl": ((_g(r"61|61\.1|64"), "is left out: grbl takes all corners by its junction deviation, $11"),),
    "fanuc": (),
}
_COMMENT = re.compile(rb"\([^()\r\n]*\)?|;[^\r\n]*")


def writes_points(dialect: DialectName) -> bool:
    """Whether the F of this control needs a decimal point."""
    return dialect == "fanuc"


def has_path_control(dialect: DialectName) -> bool:
    """Whether the control understands G61, G61.1 and G64."""
    return dialect != "grbl"


def lacks(dialect: DialectName, content: bytes) -> tuple[str, ...]:
    """Sentences on the words of a program that the control does not understand, each with the first line."""
    code = _without_comments(content)
    sentences = []
    for pattern, what in _LACKS[dialect]:
        first = re.search(pattern, code)
        if first is not None:
            count = sum(1 for _ in re.finditer(pattern, code))
            line = _line_of(code, first.start())
            word = " ".join(first[0].decode("ascii", "replace").split())[:20]
            sentences.append(f"line {line}: {_NAMES_OF[dialect]} lacks {what} ({word}, {count} in all)")
    sentences += _long_lines(dialect, content if dialect != "grbl" else code)
    if dialect == "fanuc" and b";" in content:
        line = _line_of(content, content.index(b";"))
        sentences.append(f"line {line}: Fanuc ends a block at ;: write comments in ( )")
    return tuple(sentences)


def gone(dialect: DialectName, content: bytes) -> tuple[str, ...]:
    """Sentences on words that are lost when a program is written anew, each with the first line."""
    code = _without_comments(content)
    found = ((re.search(pattern, code), what) for pattern, what in _GONE + _GONE_IN[dialect])
    return tuple(
        f"line {_line_of(code, first.start())}: {first[0].decode('ascii', 'replace')} {what}"
        for first, what in found
        if first is not None
    )


def _without_comments(content: bytes) -> bytes:
    """The code with comments replaced by blanks, so that offsets stay the same."""
    return _COMMENT.sub(lambda found: b" " * len(found[0]), content)


def _long_lines(dialect: DialectName, code: bytes) -> list[str]:
    most = _LONGEST[dialect]
    long = [
        number
        for number, line in enumerate(re.split(rb"\r\n|\n|\r", code), start=1)
        if len(line) > most and len(re.sub(rb"[ \t]", b"", line) if dialect == "grbl" else line) > most
    ]
    if not long:
        return []
    return [f"line {long[0]}: {_NAMES_OF[dialect]} takes {most} characters a line ({len(long)} are longer)"]


def _line_of(content: bytes, at: int) -> int:
    """The 1-based line number of an offset."""
    return len(re.findall(rb"\r\n|\n|\r", content[:at])) + 1
