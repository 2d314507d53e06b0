"""Events in files of every format; special cases of streams and tables."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from feedplan.errors import InputError, MissingPackageError
from feedplan.events import TimedEvents
from feedplan.outputs import FORMAT, format_named, load_setpoints
from feedplan.outputs.csv import column_names
from feedplan.setpoints import SetpointChunk
from tests.outputs.parquet import FORMATS, needs_pyarrow
from tests.outputs.written import EVENTS, chunk, header, same, written


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("cuts", [(), (1, 2, 500, 998, 999)])
def test_events_come_back_to_the_last_digit(name: str, cuts: tuple[int, ...], tmp_path: Path) -> None:
    read = load_setpoints(written(name, tmp_path, chunk(1000), cuts)).events
    assert read.sha256() == EVENTS.sha256()
    for column in ("time", "line", "kind", "channel", "value", "stops"):
        np.testing.assert_array_equal(getattr(read, column), getattr(EVENTS, column))
    assert read.text == EVENTS.text


@pytest.mark.parametrize("name", ["csv", "pvt", "halstreamer"])
def test_in_a_text_an_event_stands_before_the_first_row_at_or_after_it(name: str, tmp_path: Path) -> None:
    lines = written(name, tmp_path, chunk(1000)).read_text().splitlines()
    # No line is too long for programs that read text.
    assert max(map(len, lines)) <= 1000
    rows, before = 0, {}
    for line in lines[1 + (name != "halstreamer") :]:
        if line.startswith("# event"):
            before[json.loads(line[8:])["text"] if line.endswith("}") else "long"] = rows
        elif not line.startswith("#"):
            rows += 1
    assert rows == 1000
    assert list(before.values()) == [0, 0, 0, 1, 1, 500, 999]


def test_a_file_from_elsewhere_may_have_no_events(tmp_path: Path) -> None:
    whole = chunk(50)
    file = written("csv", tmp_path, whole)
    rows = [line for line in file.read_text().splitlines() if line[0] != "#"]
    file.write_text("\n".join(rows) + "\n")
    read = load_setpoints(file)
    assert same(read, whole)
    assert (len(read.events), read.period) == (0, None)


@pytest.mark.parametrize(
    ("event", "reason"),
    [
        ("7", "the names time, line"),
        ('{"time": 0}', "the names time, line"),
        ('{"time": "x", "line": 1, "kind": "", "channel": null, "value": 1, "stops": true, "text": ""}', "x"),
        (
            '{"time": 0, "line": 1, "kind": 3, "channel": null, "value": 1, "stops": true, "text": ""}',
            "texts",
        ),
        (
            '{"time": 0, "line": 1, "kind": "", "channel": null, "value": 1, "stops": 2, "text": ""}',
            "true or",
        ),
        (
            '{"time": 0, "line": 1e99, "kind": "", "channel": null, "value": 1, "stops": true, "text": ""}',
            "large",
        ),
    ],
)
def test_events_that_are_something_else_are_refused(event: str, reason: str, tmp_path: Path) -> None:
    file = written("csv", tmp_path, chunk(5))
    file.write_text(file.read_text() + f"# event {event}\n")
    with pytest.raises(InputError, match=f"{file}: its events are damaged .*{reason}.*: plan again"):
        load_setpoints(file)
    file.write_text(file.read_text().replace("# event ", "# event {"))
    with pytest.raises(InputError, match="# event … is not JSON"):
        load_setpoints(file)


def test_halstreamer_has_positions_and_lines_of_pins(tmp_path: Path) -> None:
    values = (np.array([[1.5, -1e-9]]), *(np.zeros((1, 2)) for _ in range(3)))
    whole = SetpointChunk(np.zeros(1), *values, np.array([7], np.int32), ("X", "A"))
    output = format_named("halstreamer")
    with output.writer(tmp_path / "a.halstream", header(whole.axes, TimedEvents.none()), 1) as add:
        add(whole)
    assert (tmp_path / "a.halstream").read_text().splitlines() == [
        '# feedplan {"kind": "halstreamer", "format": 1, "period": 0.001, "axes": ["X", "A"], '
        '"units": ["mm", "deg"], "pins": "ffs"}',
        "1.5 -1e-9 7",
    ]


def test_halstreamer_refuses_a_last_setpoint_between_two_periods(tmp_path: Path) -> None:
    whole = chunk(10)
    whole.t[-1] -= 0.0005
    with pytest.raises(InputError, match=r"the plan ends in motion at 0\.0085 s: plan with end speed 0"):
        written("halstreamer", tmp_path, whole)


def test_halstreamer_without_its_header_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.halstream"
    file.write_text("1 2 3\n")
    with pytest.raises(InputError, match="axes is missing in its comment # feedplan"):
        load_setpoints(file)


def test_steps_of_a_pvt_table_belong_to_its_times(tmp_path: Path) -> None:
    file = written("pvt", tmp_path, chunk(5))
    lines = [line for line in file.read_text().splitlines() if not line.startswith(("# event", "#+"))]
    time, _, rest = lines[-1].split(",", 2)
    file.write_text("\n".join([*lines[:-1], f"{time},0.002,{rest}"]) + "\n")
    with pytest.raises(InputError, match=r"the step to 0.004 s is 0.002 s, not the difference"):
        load_setpoints(file)


@needs_pyarrow
def test_other_packages_read_parquet(tmp_path: Path) -> None:
    import pyarrow.parquet

    whole = chunk(50, "XA")
    table = pyarrow.parquet.read_table(written("parquet", tmp_path, whole))
    assert ",".join(table.column_names) == column_names(whole.axes, ("mm", "deg"))
    np.testing.assert_array_equal(table["position A [deg]"].to_numpy(), whole.position[:, 1])
    about = json.loads(table.schema.metadata[b"feedplan"])
    assert (about["format"], about["period"], about["axes"]) == (FORMAT, 0.001, ["X", "A"])
    for metadata in (None, {"feedplan": "7"}, {"feedplan": '{"axes": ["X", "A"], "units": 7}'}):
        other = table.replace_schema_metadata(metadata)
        pyarrow.parquet.write_table(other, tmp_path / "other.parquet")
        with pytest.raises(InputError, match="its metadata have no feedplan with axes and units"):
            load_setpoints(tmp_path / "other.parquet")


def test_parquet_without_its_package_names_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("pyarrow", "pyarrow.parquet"):
        monkeypatch.setitem(sys.modules, name, None)
    sentence = r"the format parquet needs the package pyarrow: `pip install feedplan\[parquet\]`"
    with pytest.raises(MissingPackageError, match=sentence):
        written("parquet", tmp_path, chunk(5))
    (tmp_path / "a.parquet").write_bytes(b"PAR1")
    with pytest.raises(MissingPackageError, match=sentence):
        load_setpoints(tmp_path / "a.parquet")
