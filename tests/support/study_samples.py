"""A small class with a known model, and a class as run folders that nobody ran."""

import csv
import json

import numpy as np
import pyarrow.parquet as pq
from pandas import DataFrame

from replay.show.results.data_set import DATA_SET
from replay.show.results.parquet import SCHEMA, table_of
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
    answers = np.column_stack([np.clip(np.round(3 + item + 0.5 * random.normal(size=count)), 1, 5) for item in raw])
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
    rows = [
        (s, d, r, c * (1.0 if r is None else r))
        for s, c in zip(names(len(contacts)), contacts, strict=True)
        for d, r in zip(detectors, recall, strict=True)
        for _ in range(sessions)
    ]
    table = DataFrame(rows, columns=["student", "detector", "recall", "contacts_per_min"]).astype({"recall": float})
    table["contact_frames"] = table["recall"] * 0.0 + 100.0
    table["grasps"] = np.arange(len(table)) % 7.0
    return table


PAIRS = [("hand-left", "beaker"), ("hand-right", "flask"), ("beaker", "burette"), ("flask", "stand")]
TASKS, STAGES, TYPES = ("pour", "stir", None), ("first", "second"), ("immersive", "desktop")
CAUSES = ("between samples", "budget ran out")
DETECTORS = {"slow": 0.3, "coarse": 0.1}
"""Label -> share of the contacts that it never finds."""
UNREAD = dict.fromkeys(("first", "last", "deepest", "widest", "stamp_ns"), 0)
UNREAD |= {"frames": 1, "message": "", "time": 0.0, "start": 0.0, "end": 0.0}
"""What every row of a run states and no page of a class prints."""


def made_class(folder, sessions=40, students=20, *, seed=0, contacts=8, detectors=DETECTORS, nobody=0, rare=3):
    """Write run folders ``run000``, ...: the last ``nobody`` state no student; ``rare`` students alone do a task."""
    random = np.random.default_rng(seed)
    for k in range(sessions):
        who = "" if k >= sessions - nobody else f"S{k % students:03d}"
        session = Session(random, who, f"{k:016x}", detectors, rare=bool(rare) and k % students < rare)
        session.draw(int(random.poisson(contacts)), TYPES[k % students % 2])
        session.write(folder / f"run{k:03d}")
    return folder


class Session:
    def __init__(self, random, student, digest, detectors, *, rare):
        self.random, self.keys, self.detectors = random, {"session": digest, "student": student}, detectors
        self.tasks = (*TASKS, "clean") if rare else TASKS
        self.rows = {name: [] for name in DATA_SET}

    def draw(self, contacts, vr_type):
        lost = dict.fromkeys(self.detectors, 0)
        for number in range(1, contacts + 1):
            a, b = PAIRS[int(self.random.integers(len(PAIRS)))]
            start, length = float(self.random.uniform(0, 30)), float(self.random.exponential(0.2))
            missed = [label for label, fraction in self.detectors.items() if self.random.random() < fraction]
            task, stage = self.one_of(self.tasks), self.one_of(STAGES)
            row = {"body_a": a, "body_b": b, "held": bool(self.random.random() < 0.1), "task": task, "stage": stage}
            row |= {"start": start, "end": start + length}
            self.add("episodes", detector="exact", number=number, missed_by=",".join(missed), status="", **row)
            for label in missed:
                lost[label] += 1
                cut = {"kind": "never found", "cause": self.one_of(CAUSES), "cut_length": float(self.random.random())}
                self.add("misses", detector=label, number=lost[label], episode=number, **cut, **row)
        for label in self.detectors:
            for number in range(1, int(self.random.poisson(1.0)) + 1):
                gap = {"kind": "nothing there", "cause": "its collider", "gap": 0.01, "held": False}
                self.add("false_contacts", detector=label, number=number, body_a="hand-left", body_b="stand", **gap)
        minutes = float(self.random.uniform(0.4, 0.6))
        shared = {"valid_minutes": minutes, "flagged_share": float(self.random.random() * 0.02), "scene": "lab"}
        shared |= {"oracle": "exact", "vr_type": vr_type}
        for label in ("exact", *self.detectors):
            visited = contacts - lost.get(label, 0)
            frames = {"contact_frames": 9 * contacts, "recall": visited / contacts if contacts else None}
            self.add("metrics", detector=label, contacts_per_min=visited / minutes, settings="s", **shared, **frames)

    def one_of(self, values):
        return values[int(self.random.integers(len(values)))]

    def add(self, table, **row):
        self.rows[table].append(UNREAD | self.keys | row)

    def write(self, folder):
        folder.mkdir(parents=True)
        for name, (file, columns) in DATA_SET.items():
            own = {name: column.dtype for name, column in columns.items() if name != "run"}
            whole = [{column: row.get(column) for column in own} for row in self.rows[name]]
            pq.write_table(table_of(whole, own).replace_schema_metadata({"schema": SCHEMA}), folder / file)
        summary = {"made": self.keys["session"]}
        (folder / "summary.json").write_text(json.dumps(summary), "utf-8")
