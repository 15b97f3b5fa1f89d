"""Every miss of every detector of a run, numbered, looked at where the surfaces cut longest, and given its cause."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from cdcore import Detection, Motion
from replay.assembly import Assembly
from replay.audit.causes import Causes, Scene, find_causes
from replay.audit.evidence import Evidence
from replay.audit.misses import misses, stretches
from replay.audit.outcome import Comparison, Episode, Miss
from replay.detecting import Run

FaceSource = Callable[[Motion], Detection]


def examine(
    comparisons: Mapping[str, Comparison],
    contacts: Sequence[Episode],
    runs: Mapping[str, Run],
    assembly: Assembly,
    faces_of: FaceSource,
) -> tuple[dict[str, tuple[Miss, ...]], dict[str, Causes]]:
    """Misses and causes per label.

    Parameters
    ----------
    comparisons : label -> comparison, all with one oracle.
    contacts : the oracle's episodes.
    runs : every detector of the run, the oracle among them.
    faces_of : the most trusted answer, with faces, for some frames.
    """
    places = {label: stretches(comparison, contacts) for label, comparison in comparisons.items()}
    asked = [(place.pair, place.first, place.last) for found in places.values() for place in found]
    if not asked:
        return dict.fromkeys(places, ()), {label: Causes() for label in places}
    trusted = runs[next(iter(comparisons.values())).oracle]
    own = trusted.detection
    has_faces = own.face_sets is not None and own.covers == "instants" and not trusted.detector.online
    between = own.covers == "intervals"
    evidence = Evidence(assembly, own if has_faces else faces_of, asked, between=between)
    names = [(assembly.names[i], assembly.names[j]) for i, j in assembly.pairs.tolist()]
    times = assembly.motion.times
    numbered = {label: misses(found, names, times, evidence) for label, found in places.items()}
    causes = {}
    for label, found in places.items():
        run = runs[label]
        scene = Scene(assembly.motion, run.detection, own, run.detector, faces_of)
        causes[label] = find_causes(found, comparisons[label], scene)
    return {
        label: tuple(
            replace(miss, cause=cause.value) for miss, cause in zip(found, causes[label].of_misses, strict=True)
        )
        for label, found in numbered.items()
    }, causes
