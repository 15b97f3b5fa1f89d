"""A small class whose answers and behaviour follow a known model: what every test of the study starts from."""

import csv

import numpy as np
from pandas import DataFrame

from replay.studies.class_study.codebook import Codebook, Item

CODEBOOK = """
student: who
scale: [1, 5]
items:
  e1: {construct: ease of use}
  e2: {construct: ease of use}
  e3: {construct: ease of use, reversed: true}
  m1: {construct: motivation}
  m2: {construct: motivation}
  m3: {construct: motivation}
regressions:
  - {outcome: motivation, predictors: [ease of use]}
  - {outcome: motivation, predictors: [contacts_per_min, grasps]}
"""

ITEMS = ("e1", "e2", "e3", "m1", "m2", "m3")


def names(count):
    """Pseudonyms S00, S01, ..."""
    return [f"S{k:02d}" for k in range(count)]


def a_class(count=40, seed=0, slope=0.7, contacts=0.0):
    """Answers (count, 6) on a five-point scale, e3 as answered (not yet turned), and contacts per minute."""
    random = np.random.default_rng(seed)
    ease = random.normal(size=count)
    moved = random.normal(size=count)
    motivation = (
        slope * ease + contacts * moved + np.sqrt(max(0.0, 1 - slope**2 - contacts**2)) * random.normal(size=count)
    )
    raw = [ease, ease, -ease, motivation, motivation, motivation]
    answers = np.column_stack([np.clip(np.round(3 + one + 0.5 * random.normal(size=count)), 1, 5) for one in raw])
    return answers, 6.0 + 1.5 * moved


def write_answers(path, answers, students=None, extra=None):
    """A questionnaire as CSV; ``extra``: further columns by name."""
    students = names(len(answers)) if students is None else students
    extra = extra or {}
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["who", *ITEMS, *extra])
        for k, row in enumerate(answers):
            writer.writerow(
                [students[k], *("" if np.isnan(v) else f"{v:g}" for v in row), *(c[k] for c in extra.values())]
            )
    return path


def codebook(questions=(("motivation", "ease of use"),), groups=()):
    """The codebook above with other questions: (outcome, predictor, ...) each."""
    items = tuple(Item(name, "ease of use" if name[0] == "e" else "motivation", (1, 5), name == "e3") for name in ITEMS)
    return Codebook("who", items, tuple(questions), *groups)


def questionnaire(answers, arm=()):
    """The answers as read: e3 turned, and the group of each student in the column ``arm``."""
    table = DataFrame(answers, index=names(len(answers)), columns=ITEMS)
    table["e3"] = 6.0 - table["e3"]
    return table.assign(arm=arm) if len(arm) else table


def metrics(contacts, *, detectors=("exact",), recall=(1.0,), sessions=1):
    """Rows per session and detector: each detector sees the contacts its recall leaves it."""
    rows = [(s, d, r, c * (1.0 if r is None else r)) for s, c in zip(names(len(contacts)), contacts, strict=True)
            for d, r in zip(detectors, recall, strict=True) for _ in range(sessions)]  # fmt: skip
    table = DataFrame(rows, columns=["student", "detector", "recall", "contacts_per_min"]).astype({"recall": float})
    table["contact_frames"] = table["recall"] * 0.0 + 100.0
    table["grasps"] = np.arange(len(table)) % 7.0
    return table
