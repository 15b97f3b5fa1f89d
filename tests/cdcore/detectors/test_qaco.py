"""``qaco`` names faces that meet, ``hybrid-qaco`` misses contacts but reports no false ones.

``qaco`` searches faces that meet by an ant colony, with a budget; ``hybrid-qaco`` tests volumes before, and meshes
after it if ``decide`` is "mesh".
"""

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
    budget = 100 if variant == "printed" else 2000  # pairs of faces; as printed, it tests them one by one in Python
    return create_detector("qaco", bodies, variant=variant, budget=budget).detect(motion, faces=True)


@pytest.mark.slow
@pytest.mark.parametrize("variant", VARIANTS)
def test_every_contact_and_every_face_pair_is_true(variant):
    """80 frames of a laboratory: ``exact`` has the contacts and faces of ``qaco`` too; a search may
    miss some of them.
    """
    result, exact = detection_of_variant(variant), exact_detection()
    contacts = np.argwhere(result.verdict == Verdict.CONTACT).tolist()
    assert contacts
    for frame, pair in contacts:
        assert exact.verdict[frame, pair] == Verdict.CONTACT, (frame, pair)
        assert set(map(tuple, result.faces(frame, pair))) <= set(map(tuple, exact.faces(frame, pair))), (frame, pair)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("variant", VARIANTS)
def test_ant_search_answers_not_found_instead_of_clear(variant):
    """80 frames of a laboratory: a search without a hit proves nothing where bounding spheres overlap; elsewhere the
    spheres prove clear.
    """
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    spheres_overlap = create_detector("sphere", bodies).detect(motion).verdict == Verdict.CANDIDATE
    verdict = detection_of_variant(variant).verdict
    assert np.isin(verdict[spheres_overlap], [Verdict.CONTACT, Verdict.NOT_FOUND]).all()
    assert (verdict[spheres_overlap] == Verdict.NOT_FOUND).any()
    assert np.isin(verdict[~spheres_overlap], [Verdict.CLEAR, Verdict.NO_POSE]).all()


def test_default_detects_nearly_all_lab_contact():
    """The default search (memetic) found all 151 contacts of ``exact`` in 80 frames of a laboratory; 97 % leaves room
    for four that a search by chance misses.
    """
    result, exact = detection_of_variant("memetic"), exact_detection()
    contact = exact.verdict == Verdict.CONTACT
    assert (result.verdict[contact] == Verdict.CONTACT).mean() > 0.97


def test_search_counts_its_work():
    """In 80 frames of a laboratory: evaluations of a pair of faces, some of which are tested exactly, and restarts of
    the colony.
    """
    work = detection_of_variant("memetic").work
    assert work["evaluations"] > work["exact_tests"] > 0
    assert work["restarts"] > 0


def test_the_equations_as_printed_are_counted_as_broken():
    """A ball in the hole of a ring, which it does not touch: the published equations give a probability that is none,
    so that the search ends ("broken") before its budget, without a hit.
    """
    bodies = [Body("ring", torus_mesh()), Body("ball", ball_of(faces=400, radius=0.3))]
    motion, budget = motion_at_rest(bodies, [[0, 0, 0], [0.1, 0, 0]]), 20_000
    detection = create_detector("qaco", bodies, variant="printed", budget=budget).detect(motion)
    assert detection.work["broken"] == 1
    assert detection.work["evaluations"] < budget
    assert detection.verdict.tolist() == [[Verdict.NOT_FOUND]]


def test_the_corrected_equations_are_never_broken():
    """The memetic search in 80 frames of a laboratory: ``broken`` counts searches whose equations give probabilities
    that are none, as those of the paper, as printed, do.
    """
    assert detection_of_variant("memetic").work["broken"] == 0


@cache
def detection_of_lab(name, **settings):
    """The answer of a detector for FRAMES frames of five bodies of a laboratory, with faces."""
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    return create_detector(name, bodies, **settings).detect(motion, faces=True)


def test_deciding_on_meshes_gives_the_verdicts_and_faces_of_hybrid():
    """80 frames of a laboratory: with decide="mesh" meshes decide what the search leaves open; ``hybrid`` decides all
    on meshes.
    """
    mesh, hybrid = detection_of_lab("hybrid-qaco", decide="mesh"), detection_of_lab("hybrid")
    assert (hybrid.verdict == Verdict.CONTACT).any()
    assert mesh.digest == hybrid.digest
    assert mesh.faces_digest == hybrid.faces_digest


def test_explanation_of_a_contact_reports_overlapping_spheres():
    """Bodies that touch have bounding spheres that overlap, which is explained of the first contact of a laboratory."""
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    detector = create_detector("hybrid-qaco", bodies, decide="mesh")
    first_contact, *_ = np.argwhere(detection_of_lab("hybrid").verdict == Verdict.CONTACT).tolist()
    no_faces = np.zeros((0, 2), dtype=np.int64)  # faces would be for the search, which is not asked here
    assert detector.explain(motion, *first_contact, faces=no_faces).spheres_meet is True


def test_search_hits_need_no_mesh_query_without_faces():
    """80 frames of a laboratory: a hit of the search proves contact, so that meshes are queried there only if faces are
    requested.

    Verdicts are those of ``hybrid``, which decides all on meshes.
    """
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    detector = create_detector("hybrid-qaco", bodies, decide="mesh")
    plain = detector.detect(motion)
    assert plain.digest == detection_of_lab("hybrid").digest
    assert plain.work["mesh_queries"] < detector.detect(motion, faces=True).work["mesh_queries"]


def test_hybrid_takes_faces_of_the_search_where_meshes_have_none(monkeypatch):
    """80 frames of a laboratory, by ``hybrid-qaco`` with decide="mesh": a search, then the mesh stage, here made blind
    to the first three pairs: their faces must be those of the search alone.

    Those of all other pairs are those of the meshes, by ``hybrid``.
    """
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    detector = create_detector("hybrid-qaco", bodies, decide="mesh")
    by_search, by_meshes = detection_of_lab("hybrid-qaco"), detection_of_lab("hybrid")
    blind_pairs = 3
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
    assert {pair < blind_pairs for _frame, pair in contacts} == {True, False}, "contacts of both kinds of pairs"
    for frame, pair in contacts:
        expected = by_search if pair < blind_pairs else by_meshes
        assert np.array_equal(detection.faces(frame, pair), expected.faces(frame, pair)), (frame, pair)


def test_deciding_by_search_gives_no_false_contact():
    """80 frames of a laboratory: contacts of ``hybrid-qaco`` and their faces are some of those of ``exact``.

    With 50 evaluations a search it misses some contacts: these are NOT_FOUND.
    """
    search, exact = detection_of_lab("hybrid-qaco", budget=50), detection_of_lab("exact")
    contacts = np.argwhere(search.verdict == Verdict.CONTACT).tolist()
    assert contacts
    for frame, pair in contacts:
        assert exact.verdict[frame, pair] == Verdict.CONTACT, (frame, pair)
        assert set(map(tuple, search.faces(frame, pair))) <= set(map(tuple, exact.faces(frame, pair))), (frame, pair)
    missed = (exact.verdict == Verdict.CONTACT) & (search.verdict != Verdict.CONTACT)
    assert missed.any()
    assert (search.verdict[missed] == Verdict.NOT_FOUND).all()


def test_ant_search_alone_refuses_to_decide_containment():
    """``qaco``, by its usual variant ("memetic"), and ``hybrid-qaco``, over five bodies of a laboratory, ten pairs.

    A search for faces that meet which finds none does not know that surfaces are disjoint: of no pair is said whether
    one body is inside the other.
    """
    for detection in (detection_of_variant("memetic"), detection_of_lab("hybrid-qaco")):
        refusal = "refused: a search that finds nothing does not know that surfaces are disjoint"
        assert detection.containment == (refusal,) * 10


def test_ant_search_with_meshes_decides_containment_as_hybrid():
    """``hybrid-qaco`` with decide="mesh" in a laboratory; it refuses to where containment=False."""
    assert detection_of_lab("hybrid-qaco", decide="mesh").containment == detection_of_lab("hybrid").containment
    refused = detection_of_lab("hybrid-qaco", decide="mesh", containment=False)
    assert set(refused.containment) == {"refused: containment=False"}
