"""Every format reads back what it has written, and refuses other files in one sentence."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from feedplan.errors import InputError
from feedplan.outputs import FORMAT, KNOTS, SETPOINTS, format_named, formats, load_setpoints
from feedplan.outputs.csv import column_names
from feedplan.setpoints import SetpointChunk
from tests.outputs.parquet import FORMATS
from tests.outputs.written import EVENTS, NAMES, chunk, ending, header, same, written


def test_the_formats_are_found() -> None:
    assert formats() == ("csv", "halstreamer", "json", "npz", "npz-compressed", "parquet", "pvt")


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("axes", ["X", "XYZ", "XYZABC"])
def test_files_read_back_unchanged(name: str, axes: str, tmp_path: Path) -> None:
    whole = chunk(1000, axes)
    file = written(name, tmp_path, whole)
    read = load_setpoints(file)
    assert same(read, whole)
    assert (read.file, read.units, read.period) == (file, header(whole.axes).units, 0.001)
    assert read.rows == (KNOTS if name == "pvt" else SETPOINTS)


@pytest.mark.parametrize("name", FORMATS)
def test_the_size_of_chunks_does_not_matter(name: str, tmp_path: Path) -> None:
    (tmp_path / "cut").mkdir()
    whole = chunk(1000)
    in_one = written(name, tmp_path, whole)
    in_parts = written(name, tmp_path / "cut", whole, (1, 1, 500, 999))
    assert in_one.read_bytes() == in_parts.read_bytes()


@pytest.mark.parametrize("name", FORMATS)
def test_a_folder_gives_its_newest_setpoints(name: str, tmp_path: Path) -> None:
    for other in ("csv", "json", "pvt", "halstreamer", name):
        written(other, tmp_path, chunk(5))
    whole = chunk(7, seed=2)
    written(name, tmp_path, whole)
    assert same(load_setpoints(tmp_path), whole)


@pytest.mark.parametrize("name", FORMATS)
def test_a_single_setpoint_is_enough(name: str, tmp_path: Path) -> None:
    whole = chunk(1)
    assert same(load_setpoints(written(name, tmp_path, whole)), whole)


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("content", [b"", b"\x00\xff\x80 not text", b"[1, 2]", b"a,b\n1,2\n", b"PK\x03\x04"])
def test_a_file_of_something_else_is_refused_in_one_sentence(
    name: str, content: bytes, tmp_path: Path
) -> None:
    file = tmp_path / f"other{ending(name)}"
    file.write_bytes(content)
    with pytest.raises(InputError, match=str(file)) as error:
        load_setpoints(file)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", FORMATS)
def test_a_truncated_file_is_refused(name: str, tmp_path: Path) -> None:
    file = written(name, tmp_path, chunk(100))
    file.write_bytes(file.read_bytes()[:-50])
    with pytest.raises(InputError, match=str(file)):
        load_setpoints(file)


@pytest.mark.parametrize("name", FORMATS)
def test_a_missing_file_is_named(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.\w+ does not exist"):
        load_setpoints(tmp_path / f"none{ending(name)}")


@pytest.mark.parametrize("name", FORMATS)
def test_an_interrupted_write_raises_the_interrupt(name: str, tmp_path: Path) -> None:
    def write() -> None:
        output = format_named(name)
        with output.writer(tmp_path / output.FILE, header(("X",)), 100) as add:
            add(chunk(10, "X"))
            raise KeyError

    with pytest.raises(KeyError):
        write()


def test_an_unknown_ending_and_an_empty_folder_name_the_remedy(tmp_path: Path) -> None:
    (tmp_path / "setpoints.txt").touch()
    with pytest.raises(
        InputError, match=r"give a file in \.csv, \.halstream, \.json, \.npz, \.parquet, \.pvt"
    ):
        load_setpoints(tmp_path / "setpoints.txt")
    with pytest.raises(InputError, match="feedplan plan PROGRAM -o"):
        load_setpoints(tmp_path)
    with pytest.raises(
        InputError, match="use one of csv, halstreamer, json, npz, npz-compressed, parquet, pvt"
    ):
        format_named("xls")


def test_numpy_reads_npz_and_its_arrays_are_mapped(tmp_path: Path) -> None:
    whole = chunk(50)
    file = written("npz", tmp_path, whole)
    with np.load(file) as arrays:
        assert sorted(arrays) == sorted(
            (*NAMES, "axes", "format", "period", "units", "events", "event_texts")
        )
        assert arrays["events"]["kind"].tolist() == EVENTS.kind.tolist()
        assert arrays["events"]["value"][1] == -8000.0
        texts = bytes(arrays["event_texts"]).decode().split("\n")
        assert [texts[place] for place in arrays["events"]["text"]] == list(EVENTS.text)
        assert arrays["axes"].tolist() == ["X", "Y", "Z"]
        assert arrays["units"].tolist() == ["mm", "mm", "mm"]
        assert (arrays["format"], arrays["period"]) == (FORMAT, 0.001)
        for name in NAMES:
            np.testing.assert_array_equal(arrays[name], getattr(whole, name))
    read = load_setpoints(file)
    assert isinstance(read.position, np.memmap)
    assert all(getattr(read, name).flags.aligned for name in NAMES)


def test_npz_that_numpy_wrote_is_read_aligned(tmp_path: Path) -> None:
    whole = chunk(50)
    file = tmp_path / "other.npz"
    np.savez(file, axes=np.array(whole.axes), **{name: getattr(whole, name) for name in NAMES})
    read = load_setpoints(file)
    assert same(read, whole)
    assert all(getattr(read, name).flags.aligned for name in NAMES)


def test_npz_that_numpy_compressed_is_read_too(tmp_path: Path) -> None:
    whole = chunk(50)
    file = tmp_path / "other.npz"
    np.savez_compressed(file, axes=np.array(whole.axes), **{name: getattr(whole, name) for name in NAMES})
    assert same(load_setpoints(file), whole)


def test_npz_of_another_shape_or_with_objects_is_refused(tmp_path: Path) -> None:
    whole = chunk(50)
    arrays = {name: getattr(whole, name) for name in NAMES} | {"axes": np.array(whole.axes)}
    np.savez(tmp_path / "shape.npz", **(arrays | {"jerk": whole.jerk[:, :2]}))
    with pytest.raises(InputError, match=r"jerk has the shape \(50, 2\)"):
        load_setpoints(tmp_path / "shape.npz")
    np.savez(tmp_path / "lacks.npz", t=whole.t)
    with pytest.raises(InputError, match="position, velocity, acceleration, jerk, line, axes: give"):
        load_setpoints(tmp_path / "lacks.npz")
    np.savez(tmp_path / "objects.npz", **(arrays | {"t": np.array([None] * 50)}))
    with pytest.raises(InputError, match="not a whole npz file"):
        load_setpoints(tmp_path / "objects.npz")


def test_csv_has_a_header_with_units_and_exact_numbers(tmp_path: Path) -> None:
    values = (np.array([[value]]) for value in (0.1, -2.0, 1e-9, 0.0))
    whole = SetpointChunk(np.array([1e-3]), *values, np.array([7], np.int32), ("X",))
    file = written("csv", tmp_path, whole)
    assert file.read_text().splitlines()[0] == (
        '# feedplan {"kind": "setpoints", "format": 1, "period": 0.001, "axes": ["X"], "units": ["mm"]}'
    )
    assert [line for line in file.read_text().splitlines() if line[0] != "#"] == [
        "t [s],position X [mm],velocity X [mm/s],acceleration X [mm/s^2],jerk X [mm/s^3],line",
        "0.001,0.1,-2.0,1e-9,0,7",
    ]


def test_csv_that_a_spreadsheet_has_stored_is_read(tmp_path: Path) -> None:
    whole = chunk(20)
    file = written("csv", tmp_path, whole)
    file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes().replace(b"\n", b"\r\n"))
    assert same(load_setpoints(file), whole)


@pytest.mark.parametrize("name", ["csv", "halstreamer"])
def test_blank_lines_in_a_text_are_passed_over(name: str, tmp_path: Path) -> None:
    file = written(name, tmp_path, chunk(20))
    plain = load_setpoints(file)
    file.write_text(f"\n{file.read_text()}\n  \n\n")
    assert same(load_setpoints(file), plain)


def test_csv_tells_angles_in_degrees(tmp_path: Path) -> None:
    first = written("csv", tmp_path, chunk(1, "XA")).read_text().splitlines()[1]
    assert first.startswith("t [s],position X [mm],position A [deg],velocity X [mm/s],velocity A [deg/s],")


@pytest.mark.parametrize("name", ["npz", "json"])
@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"format": 7}, r"has the format 7, this feedplan reads 1: use the feedplan that wrote it"),
        ({"axes": ["X", "X"]}, "the axis X comes 2 times: give each axis once"),
        ({"units": ["mm"]}, "units are mm: give one for each of X Y"),
        ({"units": ["mm", ""]}, "units are mm : give one for each of X Y"),
        ({"period": 0.0}, r"the period is 0.0: give a positive number \[s\]"),
        ({"period": [1.0, 2.0]}, r"the period is .*: give a positive number \[s\]"),
    ],
)
def test_columns_of_a_file_are_read_and_checked(
    name: str, change: dict[str, object], sentence: str, tmp_path: Path
) -> None:
    whole = chunk(5, "XY")
    table = {key: getattr(whole, key).tolist() for key in NAMES} | {"axes": ["X", "Y"]} | change
    file = tmp_path / f"a.{name}"
    if name == "npz":
        np.savez(file, **{key: np.array(value) for key, value in table.items()})
    else:
        file.write_text(json.dumps(table))
    with pytest.raises(InputError, match=sentence):
        load_setpoints(file)


def test_npz_is_smaller_where_it_is_compressed(tmp_path: Path) -> None:
    (tmp_path / "packed").mkdir()
    whole = SetpointChunk(*(np.zeros((1000, 3)) for _ in range(5)), np.zeros(1000, np.int32), tuple("XYZ"))
    whole = SetpointChunk(np.arange(1000.0), *(getattr(whole, name) for name in NAMES[1:]), axes=whole.axes)
    plain, packed = written("npz", tmp_path, whole), written("npz-compressed", tmp_path / "packed", whole)
    assert packed.stat().st_size < 0.1 * plain.stat().st_size
    assert [entry.name for entry in packed.parent.iterdir()] == ["setpoints.npz"]
    with np.load(plain) as one, np.load(packed) as other:
        assert set(one) == set(other)
        assert all(one[name].tobytes() == other[name].tobytes() for name in one)


def test_csv_errors_name_the_line(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    rows = f"{column_names('X', ['mm'])}\n0,0,0,0,0,1\n"
    file.write_text(rows + "0,0,0,0,0\n")
    with pytest.raises(InputError, match="line 3: 5 values where 6 are needed"):
        load_setpoints(file)
    file.write_text(rows + "0,0,zero,0,0,1\n")
    with pytest.raises(InputError, match="line 3: 'zero' is not a number"):
        load_setpoints(file)


def test_json_has_the_names_of_npz_and_null_for_infinity(tmp_path: Path) -> None:
    whole = chunk(3, "XY")
    whole.jerk[1, 0] = np.inf
    file = written("json", tmp_path, whole)
    table = json.loads(file.read_text())
    assert table["axes"] == ["X", "Y"]
    assert (table["format"], table["period"], table["units"]) == (FORMAT, 0.001, ["mm", "mm"])
    assert table["position"] == whole.position.tolist()
    assert table["jerk"][1][0] is None
    assert np.isnan(load_setpoints(file).jerk[1, 0])


def test_fewer_rows_than_announced_are_a_defect(tmp_path: Path) -> None:
    output = format_named("npz")
    with (
        pytest.raises(ValueError, match="lacks"),
        output.writer(tmp_path / "a.npz", header(("X",)), 100) as add,
    ):
        add(chunk(10, "X"))


def test_the_archive_is_whole_for_other_readers(tmp_path: Path) -> None:
    file = written("npz", tmp_path, chunk(100))
    with zipfile.ZipFile(io.BytesIO(file.read_bytes())) as archive:
        assert archive.testzip() is None
