"""Proofs of small motions, and the brute force that says which of their claims are true."""

import numpy as np

from cdcore import Motion, Verdict, create_detector
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.containment.containment_stage import any_part_inside
from cdcore.numerics import place_points
from replay.pipeline.proving import tables
from replay.proof.claims import SCHEMA, Mesh, Poses, Proof


def proven(bodies, motion, pairs=None):
    """A proof of what ``exact`` says of a motion, the meshes and poses it speaks of, and the detection."""
    detection = create_detector("exact", bodies, pairs=pairs).detect(motion, faces=True)
    words = [[*pair, word] for pair, word in zip(detection.pairs.tolist(), detection.containment, strict=True)]
    header = {"schema": SCHEMA, "detector": "exact", "bodies": [body.name for body in bodies], "pairs": words}
    given = {"given_rows": np.zeros((0, 4), "<i4"), "given_poses": np.zeros((0, 12), "<f8")}
    proof = Proof(header, {**tables(bodies, detection, motion), **given})
    meshes = [Mesh(body.mesh.vertices, body.mesh.faces) for body in bodies]
    return proof, meshes, poses_of(motion), detection


def poses_of(motion):
    return Poses(motion.valid.copy(), motion.rotations.copy(), motion.translations.copy())


class Truth:
    """What is so of a pair in a frame, by every face against every face."""

    def __init__(self, bodies, motion: Motion):
        self._bodies, self._motion, self._known = bodies, motion, {}

    def faces(self, i, j, frame):
        """Face pairs that meet, as a set; ``None`` without both poses."""
        if (i, j, frame) not in self._known:
            self._known[i, j, frame] = self._asked(i, j, frame)
        return self._known[i, j, frame][0]

    def verdict(self, i, j, frame):
        self.faces(i, j, frame)
        return self._known[i, j, frame][1]

    def _asked(self, i, j, frame):
        motion = self._motion
        if not motion.valid[frame, [i, j]].all():
            return None, Verdict.NO_POSE
        poses = [(motion.rotations[frame, k], motion.translations[frame, k]) for k in (i, j)]
        meshes = [self._bodies[k].mesh for k in (i, j)]
        placed = [place_points(mesh.vertices, *pose)[mesh.faces] for mesh, pose in zip(meshes, poses, strict=True)]
        meet = {tuple(row) for row in meeting_faces_exhaustive(*placed).tolist()}
        if meet:
            return meet, Verdict.CONTACT
        (a, b), (p, q) = meshes, poses
        inside = (b.is_closed and any_part_inside(a, p, b, q)) or (a.is_closed and any_part_inside(b, q, a, p))
        return meet, Verdict.CONTAINED if inside else Verdict.CLEAR

    def holds(self, proof):
        """Whether a proof claims something of every pair-frame once, and all of it is true; why does not matter."""
        pairs, left = proof.header["pairs"], {*np.ndindex(len(proof.header["pairs"]), len(self._motion))}
        for pair, first, last, kind, _, a, b in proof["claims"].tolist():
            for frame in range(first, last + 1):
                if (pair, frame) not in left:
                    return False
                left.remove((pair, frame))
                i, j, _ = pairs[pair]
                if self.verdict(i, j, frame) != kind:
                    return False
                if kind == Verdict.CONTACT and (a, b) not in self.faces(i, j, frame):
                    return False
        return not left


def motion_of(motion, poses):
    """The motion with other poses."""
    return Motion(motion.times, poses.translation, poses.rotation, poses.valid)
