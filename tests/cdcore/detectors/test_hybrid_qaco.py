"""``hybrid-qaco`` misses but never invents when the search decides, and equals ``hybrid`` when the meshes do."""

from functools import cache

import numpy as np
import pytest
from support.shapes import lab

from cdcore import Verdict, create_detector
from cdcore.errors import InvalidSettingError


@cache
def found(name, **settings):
    bodies, motion = lab(150)
    return create_detector(name, bodies, **settings).detect(motion, faces=True)


def test_deciding_on_meshes_gives_the_verdicts_and_faces_of_hybrid():
    mesh, hybrid = found("hybrid-qaco", decide="mesh"), found("hybrid")
    assert mesh.digest == hybrid.digest
    assert mesh.faces_digest == hybrid.faces_digest
    assert Verdict.CONTAINED in hybrid.verdict or (hybrid.verdict == Verdict.CONTACT).any()


def test_contacts_the_search_has_found_need_no_mesh_query_unless_faces_are_asked():
    bodies, motion = lab(150)
    detector = create_detector("hybrid-qaco", bodies, decide="mesh")
    plain = detector.detect(motion)
    assert plain.digest == found("hybrid").digest
    assert plain.work["mesh_queries"] < detector.detect(motion, faces=True).work["mesh_queries"]
    assert found("hybrid-qaco").work["mesh_queries"] == 0


def test_deciding_by_search_invents_nothing_and_says_not_found_instead_of_clear():
    search, exact = found("hybrid-qaco"), found("exact")
    contact = search.verdict == Verdict.CONTACT
    assert (exact.verdict[contact] == Verdict.CONTACT).all()
    missed = (exact.verdict == Verdict.CONTACT) & ~contact
    assert (search.verdict[missed] == Verdict.NOT_FOUND).all()
    for frame, pair in np.argwhere(contact).tolist():
        assert set(map(tuple, search.faces(frame, pair))) <= set(map(tuple, exact.faces(frame, pair)))


def test_a_tiny_budget_misses_and_the_meshes_make_up_for_it():
    short = {"budget": 3, "warm_start": False}
    exact = found("exact").verdict == Verdict.CONTACT
    assert (found("hybrid-qaco", **short).verdict[exact] == Verdict.NOT_FOUND).any()
    assert found("hybrid-qaco", decide="mesh", **short).digest == found("hybrid").digest


def test_containment_is_refused_where_nothing_decides_it():
    assert all(word.startswith("refused: a search") for word in found("hybrid-qaco").containment)
    refused = found("hybrid-qaco", decide="mesh", containment=False).containment
    assert set(refused) == {"refused: containment=False"}
    assert found("hybrid-qaco", decide="mesh").containment == found("hybrid").containment


def test_an_unknown_way_to_decide_is_refused():
    with pytest.raises(InvalidSettingError, match="choose one of: search, mesh"):
        create_detector("hybrid-qaco", lab(2)[0], decide="luck")
