"""The tables of a run folder, whole, as a person has read them; long ones come in parts; columns say what they hold."""

from math import ceil

import pyarrow.parquet as pq
import pytest
from support.report_states import run_with_steady_times, with_steady_times
from support.small_worlds import MEET_IN_4_AND_8_TO_10, STEP_NS, unit_cubes_on_x

from replay.engine import compute
from replay.show.results import parquet_tables as tables
from replay.show.results.run_folder import write_run_folder
from sessions import Event, Interval, Scene
from sessions.model.scene import SceneBody, SceneEffect

BEGIN = 10**18
SCENE = Scene(
    bodies=(SceneBody("a"), SceneBody("b")),
    effects=(
        SceneEffect("contact", {"between": ["a", "b"]}),
        SceneEffect("hazard-proximity", {"of": "a", "hazard": "b", "distance": 1}),
    ),
)
SPANS = [Interval(BEGIN + 2 * STEP_NS, BEGIN + 9 * STEP_NS, "task", "stir", {"by": "p1"})]
EVENTS = [Event(BEGIN + 3 * STEP_NS, "buttondown", "trigger", "b")]


def cubes_with_events_and_intervals(positions=MEET_IN_4_AND_8_TO_10, **more):
    """A session of two cubes with EVENTS and SPANS."""
    return unit_cubes_on_x(positions, first_ns=BEGIN, events=EVENTS, intervals=SPANS, **more)


RUNS = {
    "audited": lambda: compute(
        cubes_with_events_and_intervals(MEET_IN_4_AND_8_TO_10 | {"c": [9] * 12}),
        detectors="slow=discrete[rate_hz=20],sphere",
    ),
    "effects of a part": lambda: compute(cubes_with_events_and_intervals(scene=SCENE), detectors=(), start=0.01),
    "nothing happened": lambda: compute(
        unit_cubes_on_x({"a": [0, 0], "b": [5, 5.01]}), detectors="hybrid", oracle="hybrid"
    ),
    "a pose in doubt": lambda: compute(unit_cubes_on_x({"a": [0] * 9, "b": [5] * 4 + [5.5] * 5}), detectors="hybrid"),
    "between frames": lambda: run_with_steady_times("between frames"),
    "undecided": lambda: run_with_steady_times("undecided"),
}


def cell_text(value):
    """The text of a value, nine digits of a number."""
    return f"{value:.9g}" if isinstance(value, float) else str(value)


@pytest.mark.parametrize("name", RUNS)
def test_tables_of_a_run_equal_their_snapshot(name, tmp_path, snapshot, monkeypatch):
    """Name and type of each column and all rows of all Parquet files of a run equal a stored text, which people read.

    Verdicts of five frames are written at once (thousands usually), so that 12 frames make three parts of a file.
    """
    monkeypatch.setattr(tables, "VERDICT_FRAMES", 5)
    make_run = RUNS[name]
    folder = write_run_folder(with_steady_times(make_run()), tmp_path / "run")
    lines = []
    for file in sorted(folder.glob("*.parquet")):
        table = pq.read_table(file)
        lines += [file.name, *(f"  {column.name}: {column.type}" for column in table.schema)]
        lines += [" | ".join(map(cell_text, row.values())) for row in table.to_pylist()]
    assert "\n".join(lines) == snapshot


def test_long_frame_table_is_made_in_pieces_of_all_rows(monkeypatch):
    """The table of frames is made whole, then in pieces of two rows: their rows are those of the whole, in order."""
    result = run_with_steady_times("several")
    (whole,) = tables.frame_table(result)
    rows_a_piece = 2
    monkeypatch.setattr(tables, "ROWS_PER_BATCH", rows_a_piece)
    pieces = list(tables.frame_table(result))
    assert len(pieces) == ceil(whole.num_rows / rows_a_piece) > 1
    assert [row for piece in pieces for row in piece.to_pylist()] == whole.to_pylist()


def test_every_column_is_described_and_written_with_its_type():
    """Each table of a run declares its columns: names that differ, a meaning of five letters or more, a type.

    Arrow's table of it has these names and types, and the same rows.
    """
    arrow_type = {str: "string", int: "int64", float: "double", bool: "bool"}
    declared_tables = run_with_steady_times("several").tables
    assert declared_tables
    for declared in declared_tables.values():
        names = [column.name for column in declared.columns]
        assert len(set(names)) == len(names)
        assert all(len(column.meaning) >= 5 for column in declared.columns)
        table = declared.to_arrow()
        assert table.schema.names == names
        assert [str(type_) for type_ in table.schema.types] == [arrow_type[column.dtype] for column in declared.columns]
        assert table.to_pylist() == declared.plain()
