from io import StringIO

from rich.console import Console
from small_worlds import cubes

from replay.auditor import audit
from replay.cli.audit_tables import audit_tables


def test_counts_and_intervals_are_shown():
    places = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
    found = audit([cubes(places), cubes(places)], detectors="slow=discrete[rate_hz=20],sphere")
    console = Console(width=150, record=True, file=StringIO())
    console.print(audit_tables(found.summary))
    text = console.export_text()
    assert "50 % [15, 85]" in text and "not asked" in text and "not examined" in text
