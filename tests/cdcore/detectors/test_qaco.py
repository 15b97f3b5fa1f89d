"""``qaco`` names faces that meet, ``hybrid-qaco`` misses but never invents."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.search_scenes import ball_of, torus_mesh
from support.shapes import lab_bodies_and_motion, motion_at_rest

from cdcore import Body, Verdict, create_detector
from cdcore.narrow.mesh_stage import MeshStage

FRAMES = 80
"""Of the lab: a second at 90 Hz, in which each of its moving bodies touches others and leaves them."""
VARIANTS = ("memetic", "corrected", "local", "random", "printed")


@cache
def exact_detection():
    """The answer of ``exact`` for FRAMES frames of bodies of a laboratory, with faces."""
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    return create_detector("exact", bodies).detect(motion, faces=True)


@cache
def detection_of_variant(variant):
    """The answer of ``qaco`` with a variant of its search, over the laboratory's motion."""
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    budget = 100 if variant == "printed" else 2000  # as printed, it looks at one pair at a time in Python
    return create_detector("qaco", bodies, variant=variant, budget=budget).detect(motion, faces=True)


@pytest.mark.slow
@pytest.mark.parametrize("variant", VARIANTS)
def test_every_contact_and_every_face_pair_is_true(variant):
    """Contacts and faces of ``exact`` are the truth; a search may miss some of them."""
    result, exact = detection_of_variant(variant), exact_detection()
    contact = result.verdict == Verdict.CONTACT
    assert (exact.verdict[contact] == Verdict.CONTACT).all()
    for frame, pair in np.argwhere(contact).tolist():
        assert set(map(tuple, result.faces(frame, pair))) <= set(map(tuple, exact.faces(frame, pair)))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("variant", VARIANTS)
def test_ant_search_answers_not_found_instead_of_clear(variant):
    """A search without a hit proves nothing where bounding spheres overlap; elsewhere the spheres prove clear."""
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    candidate = create_detector("sphere", bodies).detect(motion).verdict == Verdict.CANDIDATE
    verdicts = detection_of_variant(variant).verdict[candidate]
    assert set(np.unique(verdicts).tolist()) <= {Verdict.CONTACT, Verdict.NOT_FOUND}
    assert (detection_of_variant(variant).verdict[~candidate] != Verdict.NOT_FOUND).all()


def test_default_detects_nearly_all_lab_contact_and_counts_work():
    """Contacts are those of ``exact``; containment is refused, as a search cannot tell it."""
    result, exact = detection_of_variant("memetic"), exact_detection()
    contact = exact.verdict == Verdict.CONTACT
    # It found all of 151; 97 % leaves room for four that a search by chance misses.
    assert (result.verdict[contact] == Verdict.CONTACT).mean() > 0.97
    assert result.work["evaluations"] > result.work["exact_tests"] > 0
    assert result.work["restarts"] > 0
    assert all(word.startswith("refused") for word in result.containment)


def test_the_equations_as_printed_are_counted_as_broken():
    """The equations give a probability that is none: the search of the pair ends before its budget, without a hit.

    The corrected search of all frames of the laboratory never ends so.
    """
    bodies = [Body("ring", torus_mesh()), Body("ball", ball_of(faces=400, radius=0.3))]
    motion = motion_at_rest(bodies, [[0, 0, 0], [0.1, 0, 0]])
    detection = create_detector("qaco", bodies, variant="printed", budget=20_000).detect(motion)
    assert detection.work["broken"] == 1
    assert detection.work["evaluations"] < 20_000
    assert detection.verdict[0, 0] == Verdict.NOT_FOUND
    assert detection_of_variant("memetic").work["broken"] == 0


@cache
def detection_of_lab(name, **settings):
    """The answer of a detector for the bodies of the laboratory, with faces."""
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    return create_detector(name, bodies, **settings).detect(motion, faces=True)


def test_deciding_on_meshes_gives_the_verdicts_and_faces_of_hybrid():
    """With decide="mesh" meshes decide what the search leaves open, so that no contact is missed."""
    mesh, hybrid = detection_of_lab("hybrid-qaco", decide="mesh"), detection_of_lab("hybrid")
    assert mesh.digest == hybrid.digest
    assert mesh.faces_digest == hybrid.faces_digest
    assert Verdict.CONTAINED in hybrid.verdict or (hybrid.verdict == Verdict.CONTACT).any()


def test_explanation_of_a_contact_reports_overlapping_spheres():
    """Bodies that touch have bounding spheres that overlap: so it is said of the first contact of the laboratory."""
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    detector = create_detector("hybrid-qaco", bodies, decide="mesh")
    frame, pair = np.argwhere(detection_of_lab("hybrid").verdict == Verdict.CONTACT)[0].tolist()
    no_faces = np.zeros((0, 2), dtype=np.int64)  # faces would be for the search, which is not asked here
    assert detector.explain(motion, frame, pair, faces=no_faces).spheres_meet is True


def test_search_hits_need_no_mesh_query_without_faces():
    """A hit of the search proves contact; meshes are queried there only if faces are requested."""
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    detector = create_detector("hybrid-qaco", bodies, decide="mesh")
    plain = detector.detect(motion)
    assert plain.digest == detection_of_lab("hybrid").digest
    assert plain.work["mesh_queries"] < detector.detect(motion, faces=True).work["mesh_queries"]


def test_hybrid_takes_faces_of_the_search_where_meshes_have_none(monkeypatch):
    """The mesh stage is made blind to some pairs: there the faces must be those of the search."""
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    detector = create_detector("hybrid-qaco", bodies, decide="mesh")
    by_search, by_meshes = detection_of_lab("hybrid-qaco"), detection_of_lab("hybrid")
    blind_pairs = 3  # the first three, in which the meshes find nothing
    decide = MeshStage.decide

    def decide_blindly(stage, motion, frames, columns, *, faces):
        answer = decide(stage, motion, frames, columns, faces=faces)
        blind, no_faces = columns < blind_pairs, len(answer.sets)
        return replace(
            answer,
            hits=answer.hits & ~blind,
            which=np.where(blind, no_faces, answer.which),
            sets=[*answer.sets, np.zeros((0, 2), dtype=np.int32)],
        )

    monkeypatch.setattr(MeshStage, "decide", decide_blindly)
    detection = detector.detect(motion, faces=True)
    contacts = np.argwhere(by_search.verdict == Verdict.CONTACT).tolist()
    assert {pair < blind_pairs for _, pair in contacts} == {True, False}
    for frame, pair in contacts:
        expected = by_search if pair < blind_pairs else by_meshes
        assert np.array_equal(detection.faces(frame, pair), expected.faces(frame, pair)), (frame, pair)


def test_deciding_by_search_gives_no_false_contact():
    """Contacts of ``exact`` that the search misses are NOT_FOUND; faces of a hit are some of those of ``exact``."""
    search, exact = detection_of_lab("hybrid-qaco"), detection_of_lab("exact")
    contact = search.verdict == Verdict.CONTACT
    assert (exact.verdict[contact] == Verdict.CONTACT).all()
    missed = (exact.verdict == Verdict.CONTACT) & ~contact
    assert (search.verdict[missed] == Verdict.NOT_FOUND).all()
    for frame, pair in np.argwhere(contact).tolist():
        assert set(map(tuple, search.faces(frame, pair))) <= set(map(tuple, exact.faces(frame, pair)))


def test_ant_search_alone_refuses_to_decide_containment():
    """With meshes it decides containment as ``hybrid`` does, or refuses where the setting says so."""
    assert all(word.startswith("refused: a search") for word in detection_of_lab("hybrid-qaco").containment)
    refused = detection_of_lab("hybrid-qaco", decide="mesh", containment=False).containment
    assert set(refused) == {"refused: containment=False"}
    assert detection_of_lab("hybrid-qaco", decide="mesh").containment == detection_of_lab("hybrid").containment
