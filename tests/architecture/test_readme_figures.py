"""Figures of the README are those of the page of results, which a slow test makes again."""

import re
from pathlib import Path
from statistics import median

from replay.guide.pages import page

ROOT = Path(__file__).resolve().parents[2]
README = " ".join((ROOT / "README.md").read_text("utf-8").split())


def recordings_with_contacts():
    """Contacts and the false percentage of hulls of each real recording, from the first table of the page."""
    table = page("results").partition("| recording |")[2].partition("\n\n")[0]
    rows = [[cell.strip() for cell in line.split("|")] for line in table.splitlines()[2:]]
    return [(int(row[4]), float(re.search(r"([\d.]+) % false", row[5])[1])) for row in rows if row[4] != "0"]


def test_readme_counts_contacts_of_real_recordings_as_the_results_do():
    """Least and most contacts of the seven recordings that have any, in the first table of the page of results."""
    counts = [count for count, _ in recordings_with_contacts()]
    assert f"seven have contacts ({min(counts)} to {max(counts)} each)" in README
    assert len(counts) == 7


def test_readme_states_false_contact_of_hulls_as_the_results_do():
    """Least, most and median percentage of that table; the most is of a recording with a single contact."""
    fractions = [fraction for _, fraction in recordings_with_contacts()]
    assert f"{min(fractions):.0f} % to {max(fractions):.0f} % is false" in README
    assert f"(median {median(fractions):.0f} %" in README
    (contacts,) = [count for count, fraction in recordings_with_contacts() if fraction == max(fractions)]
    assert contacts == 1 and f"The {max(fractions):.0f} % come from a recording with one contact" in README
