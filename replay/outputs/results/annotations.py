"""What people said of single misses and false contacts of a run: ``annotations.json`` beside its tables.

An annotation belongs to a contact: the recording by its hash, a pair of bodies, and the stamps of its first and last
frame. The numbers of misses change with detectors and settings; the annotation stays with its contact.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

from replay.base.constants import BLOCK_FRAMES
from replay.errors import OutputError, RunFolderError
from replay.outputs.report.markup import page_section
from replay.outputs.results.parquet import read_table
from replay.outputs.results.run_folder import ANNOTATIONS, EPISODES, FALSE_CONTACTS, FRAMES, MISSES, REPORT, RunFolder
from replay.outputs.results.seal import SEAL
from replay.outputs.tables import Table, table
from sessions.model.event import Interval
from sessions.whole_files import check_free, whole_file

SCHEMA: Final = "vrlab-replay/annotations/1"
TAGS: Final = ("real", "artefact", "unsure")
KIND: Final = "annotation"
"""Of the intervals of a session that holds annotations."""

_SECTION: Final = re.compile(r"<!-- annotations -->.*<!-- end of annotations -->\n", re.DOTALL)


@dataclass(frozen=True)
class Annotation:
    """What one rater said of one contact."""

    session: str  # hash of the recording
    body_a: str
    body_b: str
    first_ns: int  # stamps of the first and last frame of the contact
    last_ns: int
    kind: str  # ``miss`` or ``false``: what it was when it was annotated
    detector: str  # label of the detector that was wrong
    text: str
    tag: str  # one of ``TAGS``
    rater: str

    def about(self, other: "Annotation") -> bool:
        """Whether both are of the same contact: recording, pair, and a moment in common."""
        same = (self.session, {self.body_a, self.body_b}) == (other.session, {other.body_a, other.body_b})
        return same and self.first_ns <= other.last_ns and other.first_ns <= self.last_ns

    @property
    def interval(self) -> Interval:
        """As a layer of a session has it."""
        said = {name: str(value) for name, value in asdict(self).items() if name not in ("text", "first_ns", "last_ns")}
        return Interval(self.first_ns, self.last_ns, KIND, self.text, said)


@dataclass(frozen=True)
class Fault:
    """A numbered miss or false contact of a run, as something that can be annotated."""

    number: int
    where: Annotation


def faults_of(run: RunFolder) -> list[Fault]:
    """Every numbered miss and false contact of every audited detector; of a miss the whole contact of the oracle."""
    oracle = [row for row in run.rows(EPISODES) if row["detector"] == run.summary["oracle"]]
    found = [("miss", row, _whole(row, oracle)) for row in run.rows(MISSES)]
    if (run.path / FALSE_CONTACTS).is_file():
        found += [("false", row, row) for row in run.rows(FALSE_CONTACTS)]
    if not found:
        return []
    frames = read_table(run.path / FRAMES, ["frame", "stamp_ns"])
    stamp = dict(zip(*(one.to_pylist() for one in frames.columns), strict=True))
    session = run.summary["session"]["digest"]
    return [
        Fault(row["number"], Annotation(
            session, row["body_a"], row["body_b"], stamp[contact["first"]], stamp[contact["last"]], kind,
            row["detector"], "", "", "",
        ))
        for kind, row, contact in found
    ]  # fmt: skip


def _whole(miss: Mapping[str, Any], contacts: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The contact that a miss is all of, or part of."""
    pair = miss["body_a"], miss["body_b"]
    same = (one for one in contacts if (one["body_a"], one["body_b"]) == pair)
    return next((one for one in same if one["first"] <= miss["first"] <= one["last"]), miss)


def read_annotations(folder: Path) -> list[Annotation]:
    """All annotations of a run folder, in order of time; ``RunFolderError``: the file is none of ours."""
    path = folder / ANNOTATIONS
    if not path.exists():
        return []
    try:
        said = json.loads(path.read_text(encoding="utf-8"))
        if said["schema"] != SCHEMA:
            raise ValueError(f"schema {said['schema']!r}")
        found = [Annotation(**row) for row in said["annotations"]]
        if any(type(getattr(one, field.name)) is not field.type for one in found for field in fields(one)):
            raise ValueError("a value of another kind")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunFolderError(f"{path} holds no annotations ({error}); move it away, or mend it") from error
    return sorted(found, key=lambda one: (one.first_ns, one.last_ns, one.rater))


def add_annotation(run: RunFolder, said: Annotation) -> list[Annotation]:
    """Write one more; what the same rater said of the same contact before is replaced. Returns all."""
    kept = [one for one in read_annotations(run.path) if one.rater != said.rater or not one.about(said)]
    found = sorted([*kept, said], key=lambda one: (one.first_ns, one.last_ns, one.rater))
    with whole_file(run.path / ANNOTATIONS, OutputError) as stream:
        text = json.dumps({"schema": SCHEMA, "annotations": [asdict(one) for one in found]}, indent=1)
        stream.write(f"{text}\n".encode())
    show_in_report(run)
    return found


def fault_of(run: RunFolder, kind: str, number: int, label: str | None) -> Fault:
    """The miss or false contact of this number; ``RunFolderError`` where there is none, or several have it."""
    same = [one for one in faults_of(run) if one.where.kind == kind and label in (None, one.where.detector)]
    found = [one for one in same if one.number == number]
    what = "miss" if kind == "miss" else "false contact"
    if len(found) > 1:
        names = ", ".join(one.where.detector for one in found)
        raise RunFolderError(f"several detectors have a {what} {number}; add --by with one of: {names}")
    if not found:
        most = max((one.number for one in same), default=0)
        there = f"they are numbered 1 to {most}" if most else "it has none"
        raise RunFolderError(f"{run.path} has no {what} {number}" + (f" of {label}" if label else "") + f"; {there}")
    return found[0]


def now_called(run: RunFolder, said: Annotation, faults: Sequence[Fault]) -> str:
    """What the contact of an annotation is in this run."""
    if said.session != run.summary["session"]["digest"]:
        return "of another recording"
    found = [f"{one.where.kind} {one.number} of {one.where.detector}" for one in faults if one.where.about(said)]
    return ", ".join(found) or "no fault in this run"


def annotation_table(run: RunFolder, said: Sequence[Annotation]) -> Table:
    """A row per annotation, with the numbers that its contact has in this run."""
    faults, zero = faults_of(run), run.summary["session"]["first_stamp_ns"]
    rows = [
        (now_called(run, one, faults), f"{one.body_a} and {one.body_b}", f"{(one.first_ns - zero) / 1e9:.3f}", one.tag,
         one.text, one.rater)
        for one in said
    ]  # fmt: skip
    words = ("contact", "pair", "tag", "note", "rater")
    return table(
        "What was said of single contacts", ("contact", "pair", "at s", "tag", "note", "rater"), rows, words=words
    )


def annotated_session(run: RunFolder, given: Path | None, out: Path, *, force: bool) -> None:
    """Write a copy of the recording with the annotations among its intervals; the recording stays as it is."""
    from sessions import read_session, write_session
    from sessions.doctor.pose_pass import look_through

    check_free(out, OutputError, force=force)
    recording = run.recording(given)
    if out.exists() and recording.samefile(out):
        raise OutputError(f"{out} is the recording itself, which is never changed; name another file")
    session = read_session(recording)
    run.require_digest(recording, look_through(session.blocks(BLOCK_FRAMES)).digest)
    digest = run.summary["session"]["digest"]
    layer = [one.interval for one in read_annotations(run.path) if one.session == digest]
    kept = [one for one in session.intervals if one.kind != KIND or one not in layer]
    write_session(replace(session, intervals=(*kept, *layer)), out)


def show_in_report(run: RunFolder) -> None:
    """Put the annotations of a run folder into its page, in place of those there; a page that a proof seals stays."""
    path, said = run.path / REPORT, read_annotations(run.path)
    if not path.is_file() or (run.path / SEAL).is_file():
        return
    page = _SECTION.sub("", path.read_text(encoding="utf-8"))
    if said:
        section = page_section("Annotations", annotation_table(run, said))
        marked = f"<!-- annotations -->{section}<!-- end of annotations -->\n"
        page = page.replace("</main>", f"{marked}</main>", 1)
    with whole_file(path, OutputError) as stream:
        stream.write(page.encode())
