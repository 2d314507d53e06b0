"""Programs as files, texts, bytes and streams: all are recognised by their name or by their first bytes."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

import feedplan
from feedplan.errors import ProgramError

TEXT = "G21 G90\nG1 F1000 X10\nY5\nM2\n"
CURVES = '{"curves": [{"degree": 1, "control_points": [[0, 0], [9, 0]], "feed": 10}]}'


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "part.ngc"
    path.write_text(TEXT)
    return path


def test_every_kind_of_source_gives_the_same_program(file: Path) -> None:
    with file.open("rb") as binary, file.open() as text:
        sources = [
            file,
            str(file),
            TEXT,
            TEXT.encode(),
            bytearray(TEXT.encode()),
            io.StringIO(TEXT),
            binary,
            text,
        ]
        programs = [feedplan.read_program(source, "mill") for source in sources]
    for program in programs:
        assert program.target.tolist() == programs[0].target.tolist()
        assert program.sha256 == programs[0].sha256
    assert [program.name for program in programs] == ["part.ngc"] * 2 + ["program"] * 4 + ["part.ngc"] * 2
    times = {feedplan.plan(source, "mill").time for source in (file, TEXT, TEXT.encode(), io.StringIO(TEXT))}
    assert len(times) == 1


def test_the_language_is_that_of_the_name_or_of_the_first_characters(tmp_path: Path) -> None:
    for source in (CURVES.encode(), "\n" + CURVES, b"\xef\xbb\xbf" + CURVES.encode(), io.StringIO(CURVES)):
        assert feedplan.read_program(source).target.tolist() == [[9.0, 0.0, 0.0]]
    with pytest.raises(ProgramError, match=r"^a\.ngc line 1: "):
        feedplan.read_program(CURVES.encode(), name="a.ngc")
    with pytest.raises(ProgramError, match=r"^a\.json: it is not valid JSON"):
        feedplan.read_program(TEXT, name="a.json")
    with pytest.raises(ProgramError, match=r"^program cannot be read as DXF"):
        feedplan.read_program(b"  0\r\nSECTION\r\nnonsense")
    (tmp_path / "part").write_text(CURVES)
    assert len(feedplan.read_program(tmp_path / "part")) == 1


class Slow(io.BytesIO):
    """Returns one byte at a time, as a pipe may, and counts the calls."""

    given = 0

    def read(self, size: int | None = -1) -> bytes:
        self.given += 1
        return super().read(1)


class Odd(io.BytesIO):
    def read(self, size: int | None = -1) -> bytes:
        return [1, 2]  # type: ignore[return-value]


def test_streams_are_read_to_their_end_and_not_beyond_what_is_allowed(tmp_path: Path) -> None:
    assert len(feedplan.read_program(Slow(TEXT.encode()), "mill")) == 2
    endless = Slow(b"G1 X1\n" * 1000)
    with pytest.raises(ProgramError, match="more than the 50 that are read"):
        feedplan.read_program(endless, max_bytes=50)
    assert endless.given == 51
    with pytest.raises(ProgramError, match=r"^program gives \[1, 2\]: give a stream of text or bytes"):
        feedplan.read_program(Odd(), max_bytes=50)
    with pytest.raises(ProgramError, match="/dev/zero has 51 bytes, more than the 50"):
        feedplan.read_program("/dev/zero", max_bytes=50)


def test_what_gives_no_program_is_one_sentence(tmp_path: Path) -> None:
    closed = io.BytesIO(b"G0 X1\n")
    closed.close()
    with (tmp_path / "new").open("wb") as writable:
        for source, sentence in (
            (b"", "program: the program moves nothing"),
            (io.BytesIO(b""), "program is empty: give a part program"),
            (closed, r"program cannot be read \(I/O operation on closed file\.?\): give"),
            (writable, r"new cannot be read \(read"),
            (io.StringIO("G0 X1\n" * 4), "program has 11 bytes, more than the 10 that are read"),
            (5, "the program is 5: give the path of a file, the program as text"),
        ):
            with pytest.raises(ProgramError, match=f"^{sentence}"):
                feedplan.read_program(source, max_bytes=10)


def test_the_report_quotes_lines_of_a_program_that_is_in_no_file(file: Path, tmp_path: Path) -> None:
    for name, source in (("file", file), ("text", TEXT), ("stream", io.BytesIO(TEXT.encode()))):
        feedplan.write_plan(feedplan.plan(source, "mill"), tmp_path / name, ())
        assert "<code>G1 F1000 X10" in (tmp_path / name / "report.html").read_text(encoding="utf-8")
