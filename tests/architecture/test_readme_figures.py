"""Figures of the README are those of the page of results, which a slow test makes again."""

import re
from pathlib import Path
from statistics import median
from typing import NamedTuple

from replay.guide.pages import page

ROOT = Path(__file__).resolve().parents[2]
README = " ".join((ROOT / "README.md").read_text("utf-8").split())


class Recording(NamedTuple):
    """A real recording with contacts: how many, and the percentage of contact time that hulls report falsely."""

    contacts: int
    false_percent: float


def recordings_with_contacts():
    """The recordings that have any contact, from the first table of the page of results."""
    table = page("results").partition("| recording |")[2].partition("\n\n")[0]
    rows = [[cell.strip() for cell in line.split("|")] for line in table.splitlines()[2:]]
    recordings = [
        Recording(contacts=int(row[4]), false_percent=float(re.search(r"([\d.]+) % false", row[5])[1]))
        for row in rows
        if row[4] != "0"
    ]
    assert len(recordings) == 7
    return recordings


def test_readme_counts_contacts_of_real_recordings_as_the_results_do():
    """Least and most contacts of the seven recordings that have any, by the first table of the page "results"."""
    counts = [recording.contacts for recording in recordings_with_contacts()]
    assert f"seven have contacts ({min(counts)} to {max(counts)} each)" in README


def test_readme_states_false_contact_of_hulls_as_the_results_do():
    """Least, most and median percentage of the page "results"; the most is of a recording with a single contact."""
    recordings = recordings_with_contacts()
    percentages = [recording.false_percent for recording in recordings]
    assert f"{min(percentages):.0f} % to {max(percentages):.0f} % is false" in README
    assert f"(median {median(percentages):.0f} %" in README
    (worst,) = [recording for recording in recordings if recording.false_percent == max(percentages)]
    assert worst.contacts == 1
    assert f"The {worst.false_percent:.0f} % come from a recording with one contact" in README
