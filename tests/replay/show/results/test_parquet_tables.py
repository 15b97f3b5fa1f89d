"""The tables of a run folder, whole, as a person has read them; long ones come in parts; columns say what they hold."""

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
    """Names and types of columns, and all rows; a run of 12 frames is written in three parts."""
    monkeypatch.setattr(tables, "VERDICT_FRAMES", 5)
    make_run = RUNS[name]
    folder = write_run_folder(with_steady_times(make_run()), tmp_path / "run")
    lines = []
    for file in sorted(folder.glob("*.parquet")):
        table = pq.read_table(file)
        lines += [file.name, *(f"  {column.name}: {column.type}" for column in table.schema)]
        lines += [" | ".join(map(cell_text, row.values())) for row in table.to_pylist()]
    assert "\n".join(lines) == snapshot


def test_long_frame_table_joins_from_its_row_groups(monkeypatch):
    """Two rows a group; together they are the table that is made at once."""
    result = run_with_steady_times("several")
    (whole,) = tables.frame_table(result)
    monkeypatch.setattr(tables, "ROWS_PER_BATCH", 2)
    pieces = list(tables.frame_table(result))
    assert len(pieces) == -(-whole.num_rows // 2)
    assert [row for piece in pieces for row in piece.to_pylist()] == whole.to_pylist()


def test_every_column_is_described_and_written_with_its_type():
    """Columns say name, type and meaning; Arrow's table has these names, types and the same rows."""
    for made in run_with_steady_times("several").tables.values():
        columns = made.columns
        assert len({column.name for column in columns}) == len(columns)
        assert all(len(column.meaning) > 4 for column in columns)
        table = made.to_arrow()
        assert table.schema.names == [column.name for column in columns] and table.to_pylist() == made.plain()
        kinds = {str: "string", int: "int64", float: "double", bool: "bool"}
        assert [str(kind) for kind in table.schema.types] == [kinds[column.dtype] for column in columns]
