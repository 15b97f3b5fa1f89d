"""``replay demo --class``: a made-up class, the whole way from its recordings to its page."""

from pathlib import Path
from typing import Final

from replay.cli.console import DATA_LOSS, OK, People, counting

STUDENTS: Final = 52
"""As many as in the paper's study."""


def demo_class(out: Path, students: int, *, seed: int, jobs: int, people: People) -> int:
    """Make up a class, replay its sessions, analyse it, all in one folder; killed, it goes on where it stopped."""
    from replay.cli.study import require_extra, write_page
    from replay.studies.class_study.synthetic_class import ANSWERS, CODEBOOK, SESSIONS, make_class

    require_extra()
    people.say(f"making up {students} students and recording their sessions ...")
    failed = make_class(out, students=students, seed=seed, jobs=jobs, on_done=counting(people, students))
    files = sorted((out / SESSIONS).glob("*.mcap"))
    people.say(f"replaying {len(files)} sessions ...")
    from replay.api.batch import run_batch

    settings = {"seed": 0, "picture": False}  # the usual detectors, as the demo asks
    batch = run_batch(files, out / "runs", jobs=jobs, settings=settings, on_done=counting(people, len(files)))
    write_page(
        out / "runs",
        out / "study",
        questionnaire=out / ANSWERS,
        codebook=out / CODEBOOK,
        people=people,
        seed=seed,
        force=True,
        title="A class that was made up",
    )
    return DATA_LOSS if failed or batch.failed else OK
