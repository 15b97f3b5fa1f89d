"""Both volumes together keep every contact, and what either rejects is clear."""

import numpy as np
from support.shapes import lab

from cdcore import Verdict, create_detector
from cdcore.bounding.box import box_best
from cdcore.bounding.sphere import sphere_best
from cdcore.broad.box_stage import BoxStage
from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.sphere_stage import SphereStage
from cdcore.protocol import resolve_pairs


def test_what_may_meet_is_what_spheres_and_boxes_let_through_and_holds_every_contact():
    bodies, motion = lab(300)
    pairs = resolve_pairs(bodies, None)
    answer = BroadPhase(bodies, pairs).candidates(motion)
    spheres = SphereStage([sphere_best(body.mesh) for body in bodies], pairs).candidates(motion)
    columns, frames = np.nonzero(spheres.verdict.T == Verdict.CANDIDATE)
    meet = BoxStage([box_best(body.mesh) for body in bodies], pairs).may_meet(motion, frames, columns)
    assert 0 < meet.sum() < len(meet)
    assert np.array_equal([answer.frames, answer.columns], [frames[meet], columns[meet]])
    assert answer.work == {"sphere_tests": spheres.tests, "skipped": spheres.skipped, "box_tests": len(frames)}
    spheres.verdict[frames, columns] = Verdict.CLEAR
    assert np.array_equal(answer.verdict, spheres.verdict)
    assert len(answer.clock) == 3 and answer.clock == sorted(answer.clock)
    near = set(zip(answer.frames.tolist(), answer.columns.tolist(), strict=True))
    contacts = create_detector("exact", bodies).detect(motion).verdict == Verdict.CONTACT
    assert contacts.any() and near >= {tuple(place) for place in np.argwhere(contacts).tolist()}
