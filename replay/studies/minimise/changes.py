"""What taking something out of a recording changed in its contacts: `exact` is asked before and after."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np

from cdcore import Verdict
from cdcore.protocol import counts_as_contact
from replay.comparison.tolerance import TAU, Tolerance
from replay.detection.detector_spec import TRUSTED, parse_detector
from replay.detection.run_detector import run_detector
from replay.errors import AssemblyError
from replay.pipeline.engine import prepared
from replay.pipeline.faces import face_source
from replay.studies.minimise.names import Names
from sessions import Session


@dataclass(frozen=True)
class Difference:
    """One pair-frame whose verdict is another: the pair by its new names, seconds after the first frame."""

    frame: int
    time: float
    pair: str
    before: str
    after: str
    within_tau: bool


@dataclass(frozen=True)
class Changes:
    """The contacts of a recording before and after."""

    pair_frames: int  # how many were asked both times
    contacts: int  # how many of them are contact before
    differences: tuple[Difference, ...]  # all that differ, in order of time
    # gone, new: pairs that were asked only before, only after
    gone: tuple[str, ...]
    new: tuple[str, ...]

    def as_json(self) -> dict[str, object]:
        """All of it."""
        return asdict(self)

    def sentences(self) -> Iterator[str]:
        """All of it in words, each pair-frame that differs on a line."""
        count, within = len(self.differences), sum(one.within_tau for one in self.differences)
        said = (
            f"contacts by exact: {count:,} of {self.pair_frames:,} pair-frames differ; {self.contacts:,} were contact"
        )
        yield said + (f"; {within:,} of the {count:,} are within tolerance" if count else "")
        for one in self.differences:
            words = " (within tolerance)" * one.within_tau
            yield f"  frame {one.frame} at {one.time:.3f} s, {one.pair}: {one.before} became {one.after}{words}"
        for words, pairs in (("only before", self.gone), ("only after", self.new)):
            if pairs:
                yield f"asked {words}: {', '.join(pairs)}"


def changes(before: Session, after: Session, names: Names, tau: float = TAU) -> Changes:
    """Ask ``exact`` about both; bodies of ``before`` are called by their new names.

    Raises ``AssemblyError``: nothing to ask, or other frames afterwards; other errors as of `prepared`.
    """
    spec, ready, answers = parse_detector(TRUSTED), [], []
    for session in (before, after):
        assembly = prepared(session).assembly
        ready.append(assembly)
        answers.append(run_detector(spec, assembly, seed=0, faces=False, advance=lambda _: None))
    old, new = ready
    if not np.array_equal(old.motion.times, new.motion.times):
        raise AssemblyError("the frames are others than before, so contacts cannot be set side by side")
    was = {"-".join(sorted(names.of("body", old.bodies[k].name) for k in row)): p for p, row in enumerate(old.pairs)}
    now = {"-".join(sorted(new.bodies[k].name for k in row)): p for p, row in enumerate(new.pairs)}
    shared = [key for key in was if key in now]
    first = answers[0].detection.verdict[:, [was[key] for key in shared]]
    second = answers[1].detection.verdict[:, [now[key] for key in shared]]
    frames, columns = np.nonzero(first != second)
    # Judged where the answers came from: the poses as recorded.
    within = np.zeros(len(frames), dtype=np.bool_)
    if len(frames):
        verdict = answers[0].detection.verdict.copy()
        ours = np.array([was[key] for key in shared])
        verdict[:, ours] = second
        judged = replace(answers[0].detection, verdict=verdict)
        judge = Tolerance(old, face_source(old, 0, None), tau).judge(judged, answers[0].detection)
        within = judge(frames, ours[columns])
    return Changes(
        int(first.size), int(counts_as_contact(first).sum()),
        tuple(
            Difference(frame, float(old.motion.times[frame]), shared[column], Verdict(first[frame, column]).name,
                       Verdict(second[frame, column]).name, bool(excused))
            for frame, column, excused in zip(frames.tolist(), columns.tolist(), within, strict=True)
        ),
        tuple(key for key in was if key not in now), tuple(key for key in now if key not in was),
    )  # fmt: skip
