from decimal import Decimal

import pyarrow.parquet as pq
import pytest
from support.report_states import ABOUT, price_row
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

from replay.advice import sweep as trading
from replay.advice.pareto import advice_of
from replay.advice.settings import Setting
from replay.cli.main import main
from replay.cli.tradeoff import percent_of_settings
from replay.document import columns
from replay.document.run_result import Tradeoff
from replay.document.tables import Column
from replay.show.report.tradeoff import tradeoff_values
from replay.show.results.run_folder import read_run_folder
from replay.show.tradeoff_table import tradeoff_list, tradeoff_numbers
from sessions import write_session

# Two contacts, in frame 4 and in frames 8 to 10 of 12 at 100 Hz: those of 20 Hz, every fifth, may miss either.


@pytest.fixture
def session_file(tmp_path, monkeypatch):
    """A session, on a machine on which three settings are tried."""
    rate = Setting("meshes at 20 Hz", "collider", {"shape": "mesh", "rate_hz": 20.0})
    settings = (Setting("FCL", "hybrid"), Setting("balls", "sphere"), rate)
    monkeypatch.setattr(trading, "settings_list", lambda **_: settings)
    write_session(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), tmp_path / "s.mcap")
    return str(tmp_path / "s.mcap")


def test_settings_and_advice_are_printed_and_the_folder_is_written(session_file, tmp_path, capsys):
    """Three settings of detectors are tried on a session, sorted by what they lose; the mean ms of each has two digits.

    Screen, page, document and table agree. A folder that exists is not written over.
    """
    assert main(["tradeoff", session_file, "--out", str(tmp_path / "costs"), "--no-picture"]) == 0
    out, err = capsys.readouterr()
    screen = " ".join(out.split())
    assert err.index("outside the time limit: one audit") < err.index("wrote ") < err.index("report.html")
    # By loss: FCL has none. By the moment at which sampling at 20 Hz starts, it cuts none or one contact short.
    assert screen.index("FCL") < screen.index("meshes at 20 Hz") and "0-1" in screen
    # Times measured while others use the processor may be too uncertain for an advice.
    assert "Missing nothing costs" in screen or "No advice about cost until then." in screen
    reported = read_run_folder(tmp_path / "costs").document.tradeoff
    written = pq.read_table(tmp_path / "costs" / "tradeoff.parquet").to_pylist()
    key_of_column = {
        "missed": "missed",
        "late_or_cut_short": "late",
        "loss": "loss",
        "mean_ms": "mean_ms",
        "settings": "settings",
    }
    assert [[row[name] for name in key_of_column] for row in written] == [
        [row[key] for key in key_of_column.values()] for row in reported.rows
    ]
    report = (tmp_path / "costs" / "report.html").read_text("utf-8")
    for row in reported.rows:
        mean_ms = format(Decimal(f"{row['mean_ms']:.1e}").normalize(), "f")
        assert f" {mean_ms} " in screen and f">{mean_ms}<" in report
    assert main(["tradeoff", session_file, "--out", str(tmp_path / "costs")]) != 0
    assert "costs exists; name another folder" in " ".join(capsys.readouterr().err.split())


def test_settings_cut_by_the_time_limit_are_counted(session_file, capsys):
    """The first of three settings of detectors is tried in 0 s, and no other; with ``-v`` the others are named."""
    assert main(["tradeoff", session_file, "--time-limit", "0", "-v"]) == 0
    out, err = capsys.readouterr()
    assert "2 settings were not tried within 0 s" in out and "not tried: balls, meshes at 20 Hz" in err


def tradeoff_of(count, **about):
    """So many settings r0, r1, ... of which the first and the last are the front, and two that were not tried.

    The front is the settings than which no other is both quicker and more accurate.
    """
    rows = [price_row(f"r{k}", 1.0 + k, k, front=k in (0, count - 1)) for k in range(count)]
    return Tradeoff(rows=tuple(rows), front=("r0",), advice=tuple(advice_of(rows)), cut=("x", "y"), about=ABOUT | about)


def test_a_new_column_appears_in_terminal_report_and_parquet(monkeypatch):
    """A column "probe" is declared once, among the columns of a tradeoff; of settings r0 to r2 it says marker-r0 ..."""
    probe = Column("probe", of=lambda row: f"marker-{row['label']}")
    monkeypatch.setitem(columns.COLUMNS, "tradeoff", (*columns.COLUMNS["tradeoff"], probe))
    tradeoff = tradeoff_of(count=3)
    expected = ["marker-r0", "marker-r1", "marker-r2"]
    terminal, report, parquet = (
        tradeoff_list(tradeoff), tradeoff_values(tradeoff)["table"], tradeoff_numbers(tradeoff),
    )  # fmt: skip
    assert terminal.column("probe") == report.column("probe") == parquet.column("probe") == expected


def test_long_lists_are_cut_short_but_never_the_front():
    """30 settings, r0 to r29, and two that were not tried; r0 and r29 are marked as the front, which none beats.

    A short list has twelve rows, and r29, of the front; with ``-v`` it is complete. The time limit was 20 s.
    """
    short, complete = tradeoff_list(tradeoff_of(count=30)), tradeoff_list(tradeoff_of(count=30), is_complete=True)
    setting_of_last_row, *_ = short.rows[-1]
    assert len(short.rows) == 12 + 1 and setting_of_last_row == "r29" and len(complete.rows) == 30
    assert short.notes[0] == "... 17 more with -v; 2 settings were not tried within 20 s"
    assert complete.notes[0] == "... 2 settings were not tried within 20 s"


def test_busy_machine_is_reported():
    """While four settings were timed the program had 31 % of the processor, and others 69 %."""
    notes = " ".join(tradeoff_list(tradeoff_of(count=4, processor_share=0.31), is_complete=True).notes)
    assert "The machine was busy (69 %)" in notes


def test_tradeoff_progress_never_falls_and_ends_at_100():
    """Settings begun and settings planned until then: 3 of 6, then, as more are planned, 6, 14 and 20 of 20.

    ``steps``: percent by which the progress advances at each; 6 of 20 would be less than 3 of 6.
    """
    steps = []
    report_progress = percent_of_settings(steps.append)
    for begun, planned in ((3, 6), (6, 20), (14, 20), (20, 20)):
        report_progress(begun, planned)
    assert min(steps) >= 0 and sum(steps) == 100
