"""A synthetic class: answers and behaviour of its students are drawn from a model that is written down.

In the model, ease of use is associated with motivation and with fewer accidental touches; near misses with nothing. In
a class of brief touches, students who find it hard touch more often, but so briefly that samples miss some touches.
"""

import json
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Final

import numpy as np

from replay.errors import OutputError
from replay.running.workers import OnDone, do_all
from sessions.synthetic.rng import random_stream
from sessions.whole_files import whole_file

STUDENT_COUNT: Final = 52
SESSIONS_FOLDER: Final = "sessions"
QUESTIONNAIRE_FILE: Final = "questionnaire.csv"
CODEBOOK_FILE: Final = "codebook.yaml"
TRUTH_FILE: Final = "truth.json"
ITEMS_PER_SCALE: Final = 4
GROUP_NAMES: Final = ("first", "second")
"""Students are in them by turns: in the model the groups do not differ."""


CLASS_MODEL: Final = {
    "ease_motivation": 0.6,
    "immersion_motivation": 0.3,
    "ease_touches": -0.6,
    "item_noise": 0.8,
    "mean_touches": 3.0,
    "touch_spread": 1.6,
    "mean_near": 1.0,
}
"""The truth behind a class: how latent traits (mean 0, deviation 1) go together, and how answers scatter. The first two
are shares in motivation, ``ease_touches`` that of ease in the number of accidental touches.
"""

BRIEF_TOUCHES: Final = {"touches_hard": 13, "seconds_hard": 0.013, "touches_easy": 11, "seconds_easy": 0.15}
"""A class of brief touches: their number, give or take one, and how long they last where ease is below its mean (hard),
and above it. A brief touch covers one frame at 90 Hz or two, so that colliders at 50 Hz miss some."""


@dataclass(frozen=True)
class Student:
    """Behaviour and answers of one student."""

    pseudonym: str
    group: str
    answers: dict[str, int]
    touches: tuple[float, ...]
    near: int


def draw_class(students: int = STUDENT_COUNT, seed: int = 0, *, are_touches_brief: bool = False) -> list[Student]:
    """Draw the students, of ``are_touches_brief`` touches if asked.

    Each depends on the seed and on its own number alone.
    """
    return [_draw_student(k, seed, are_touches_brief) for k in range(students)]


def make_class(
    out: Path,
    *,
    students: int = STUDENT_COUNT,
    seed: int = 0,
    brief: bool = False,
    jobs: int = 1,
    on_done: OnDone | None = None,
) -> dict[str, str]:
    """Write sessions, questionnaire, codebook and truth to a folder; what is there already is kept.

    Returns student -> why the session could not be made; ``OutputError`` where the folder holds something else.
    """
    from pandas import DataFrame

    students_drawn = draw_class(students, seed, are_touches_brief=brief)
    model = CLASS_MODEL | BRIEF_TOUCHES if brief else CLASS_MODEL
    truth = json.dumps({"seed": seed, "students": students, "model": model}, indent=1) + "\n"
    _check_folder(out, truth)
    (out / SESSIONS_FOLDER).mkdir(parents=True, exist_ok=True)
    _write_text(out / TRUTH_FILE, truth)
    answers = DataFrame(
        [
            {"student": drawn_student.pseudonym, "group": drawn_student.group, **drawn_student.answers}
            for drawn_student in students_drawn
        ]
    )
    _write_text(out / QUESTIONNAIRE_FILE, answers.to_csv(index=False, lineterminator="\n"))
    codebook_file = files("replay.studies.class_study").joinpath("class_codebook.yaml")
    _write_text(out / CODEBOOK_FILE, codebook_file.read_text(encoding="utf-8"))
    tasks = {}
    for k, student in enumerate(students_drawn):
        path = out / SESSIONS_FOLDER / f"{student.pseudonym}.mcap"
        if not path.is_file():
            tasks[student.pseudonym] = (student, path, seed + 1000 * (k + 1))
    return do_all(record_student, tasks, jobs, on_done)


def record_student(student: Student, path: Path, seed: int) -> str:
    """Make and write the session of a student; why it could not be, or ``""``."""
    from sessions import write_session
    from sessions.synthetic.experiments.practice import make_practice

    try:
        session, _ = make_practice(student.touches, student.near, pseudonym=student.pseudonym, seed=seed)
        write_session(session, path)
    except Exception as error:
        return " ".join(f"{type(error).__name__}: {error}".split())
    return ""


def _draw_student(k: int, seed: int, are_touches_brief: bool) -> Student:
    random = random_stream(seed, "student", str(k))
    ease, use, immersion, own_motivation, clumsiness = random.normal(size=5)
    shared_trait = CLASS_MODEL["ease_motivation"] * ease + CLASS_MODEL["immersion_motivation"] * immersion
    unexplained_weight = np.sqrt(1.0 - CLASS_MODEL["ease_motivation"] ** 2 - CLASS_MODEL["immersion_motivation"] ** 2)
    traits = {"ease": ease, "use": use, "imm": immersion, "mot": shared_trait + unexplained_weight * own_motivation}
    answers = {}
    for item_prefix, trait in traits.items():
        for item in range(1, ITEMS_PER_SCALE + 1):
            item_sign = -1.0 if item == ITEMS_PER_SCALE else 1.0
            answer = random.normal(3.0 + item_sign * trait, CLASS_MODEL["item_noise"])
            answers[f"{item_prefix}{item}"] = min(max(round(answer), 1), 5)
    touch_tendency = CLASS_MODEL["ease_touches"] * ease + np.sqrt(1.0 - CLASS_MODEL["ease_touches"] ** 2) * clumsiness
    touch_count = round(CLASS_MODEL["mean_touches"] + CLASS_MODEL["touch_spread"] * touch_tendency)
    touch_count = min(max(touch_count, 0), 8)
    touches = tuple(np.round(np.exp(random.uniform(np.log(0.02), np.log(0.3), touch_count)), 4).tolist())
    near_count = int(min(3, random.poisson(CLASS_MODEL["mean_near"])))
    if are_touches_brief:
        touches = _brief_touches(float(ease), int(random.integers(-1, 2)))
    return Student(f"S{k + 1:02d}", GROUP_NAMES[k % 2], answers, touches, near_count)


def _brief_touches(ease_trait: float, extra_touches: int) -> tuple[float, ...]:
    """Seconds of each touch, ``extra_touches`` or fewer than usual; brief where ease is below its mean."""
    trait = "hard" if ease_trait < 0.0 else "easy"
    return (BRIEF_TOUCHES[f"seconds_{trait}"],) * (int(BRIEF_TOUCHES[f"touches_{trait}"]) + extra_touches)


def _check_folder(out: Path, truth: str) -> None:
    if not out.exists() or (out.is_dir() and not any(out.iterdir())):
        return
    if not (out / TRUTH_FILE).is_file():
        raise OutputError(f"{out} holds something else than a made-up class; name another folder")
    if (out / TRUTH_FILE).read_text(encoding="utf-8") != truth:
        raise OutputError(f"{out} holds a class of another seed or size; name another folder")


def _write_text(path: Path, text: str) -> None:
    with whole_file(path, OutputError) as file:
        file.write(text.encode())
