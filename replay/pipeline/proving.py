"""Writes down why each verdict of ``exact`` is so, for ``replay.proof``, which shares no code with what decided it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Detection, Motion, Verdict
from cdcore.narrow.containment.containment_stage import ContainmentStage
from cdcore.narrow.containment.witnesses import corners_inside
from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.far_poses import far_poses
from cdcore.narrow.spacetime.fronts import APART, EVERY_FACE, PairFronts
from cdcore.numerics import FloatArray, IntArray
from replay.detection.detector_spec import TRUSTED
from replay.errors import ProofError
from replay.pipeline.run_result import RunResult
from replay.prepare.assembly import PoseOrigin
from replay.proof.claims import SCHEMA, Proof
from replay.proof.claims import Poses as ProofPoses
from replay.proof.loading import mesh_hash, mesh_of, recorded, scene_hash
from sessions import Session

ROOM: Final = 2.0**-20
"""Two far bodies are called apart from this share of their distance from the origin on; else all faces are asked."""


def prove(result: RunResult, session: Session) -> Proof:
    """The proof of the oracle's verdicts about a recording; ``ProofError``: the oracle is not ``exact``.

    ``session`` is the recording as it was, before any repair.
    """
    oracle, assembly = result.detections.get(result.oracle), result.assembly
    if oracle is None or oracle.detector != TRUSTED or oracle.face_sets is None:
        raise ProofError(f"a proof is of the verdicts of {TRUSTED!r} with its faces; make it the oracle")
    known = recorded(session, assembly.names)
    first = int(np.searchsorted(known.stamp_ns, assembly.stamp_ns[0]))
    stop = first + len(assembly.stamp_ns)
    if not np.array_equal(known.stamp_ns[first:stop], assembly.stamp_ns):
        raise ProofError("the frames are not consecutive ones of the recording; replay it as it is")
    rows, poses = _given(result, known.poses.part(first, stop))
    spans = () if result.treatment is None else result.treatment.spans
    header = {
        "schema": SCHEMA, "detector": result.oracle, "frames": [first, stop], "bodies": list(assembly.names),
        "meshes": [mesh_hash(mesh_of(session, name)) for name in assembly.names], "scene": scene_hash(session),
        "pairs": [[*pair, word] for pair, word in zip(assembly.pairs.tolist(), oracle.containment, strict=True)],
        "flags": [[one.kind, one.body, one.start_ns, one.end_ns, one.action] for one in spans
                  if one.dropped + one.held + one.interpolated],
    }  # fmt: skip
    given = {"given_rows": rows.astype("<i4"), "given_poses": poses.astype("<f8")}
    return Proof(header, {**tables(assembly.bodies, oracle, assembly.motion), **given})


def tables(bodies: Sequence[Body], oracle: Detection, motion: Motion) -> dict[str, NDArray[Any]]:
    """Why every verdict of ``exact``, with its faces, is so: the tables of a proof but the poses it gives."""
    book, stage = _Book(bodies), ContainmentStage(bodies, oracle.pairs)
    claims = [_pair_claims(book, oracle, motion, stage, p) for p in range(len(oracle.pairs))]
    ends = np.cumsum([len(one) for one in book.fronts])
    return {
        "claims": np.concatenate([np.zeros((0, 7), dtype=np.int64), *claims]).astype("<i4"),
        "fronts": np.frombuffer(b"".join(book.fronts), dtype=np.uint8), "front_ends": ends.astype("<i8"),
        **book.trees(),
    }  # fmt: skip


class _Book:
    """Fronts by number, and which nodes of each body's tree they speak of."""

    def __init__(self, bodies: Sequence[Body]) -> None:
        self._trees = [build_box_tree(body.mesh.triangles) for body in bodies]
        self._used = [np.arange(len(tree.links)) == 0 for tree in self._trees]
        self._numbers: dict[bytes, int] = {}

    @property
    def fronts(self) -> list[bytes]:
        """All fronts, by number."""
        return list(self._numbers)

    def of(self, i: int, j: int, rotations: FloatArray, translations: FloatArray) -> IntArray:
        """Numbers of the fronts of two bodies in K frames without contact, (K, 2, 3, 3) and (K, 2, 3)."""
        trees = self._trees[i], self._trees[j]
        reach, everywhere = np.array([tree.reach for tree in trees]), np.ones((len(rotations), 2), dtype=np.bool_)
        far = far_poses(translations, everywhere, reach)
        alone = np.zeros(len(rotations), dtype=np.bool_) if far is None else far.any(axis=1)
        found = np.empty(len(rotations), dtype=np.int64)
        found[alone] = self._numbered([_far_front(place, float(reach.sum())) for place in translations[alone]])
        walks = PairFronts(trees)
        fronts, which = walks.of(rotations[~alone], translations[~alone])
        found[~alone] = self._numbered(fronts)[which]
        for body, nodes in zip((i, j), walks.nodes, strict=True):
            self._used[body][nodes] = True
        return found

    def _numbered(self, fronts: list[bytes]) -> IntArray:
        for front in dict.fromkeys(fronts):
            self._numbers.setdefault(front, len(self._numbers))
        return np.array([*map(self._numbers.__getitem__, fronts)], dtype=np.int64)

    def trees(self) -> dict[str, NDArray[Any]]:
        """The part of every tree that fronts speak of: ``faces/k``, ``nodes/k`` and ``axes/k``."""
        tables: dict[str, NDArray[Any]] = {}
        for k, (tree, used) in enumerate(zip(self._trees, self._used, strict=True)):
            rows = np.flatnonzero(used)
            nodes = np.empty((len(tree.links), 2), dtype=np.int64)
            for node in range(len(tree.links) - 1, -1, -1):
                child, leaf = tree.links[node].tolist()
                below = nodes[child : child + 2]
                nodes[node] = tree.leaves[leaf, :2] if leaf >= 0 else (below[0, 0], below[:, 1].sum())
            child = tree.links[rows, 0].astype(np.int64)
            opened = (child >= 0) & used[child]
            kept = np.column_stack([nodes[rows], np.where(opened, np.searchsorted(rows, child), -1)])
            group = np.zeros(len(tree.faces), dtype=np.int64)
            group[kept[~opened, 0]] = 1
            # within a node that is not opened, in the order of the mesh: that packs better
            tables[f"faces/{k}"] = tree.faces[np.lexsort((tree.faces, np.cumsum(group)))].astype("<i4")
            tables[f"nodes/{k}"] = kept.astype("<i4")
            tables[f"axes/{k}"] = tree.boxes[rows][:, [3, 6, 9, 4, 7, 10]].astype("<f4")
        return tables


def _far_front(places: FloatArray, reach: float) -> bytes:
    """The front of two bodies at these places, (2, 3), one of them far from the rest of the recording."""
    away = float(np.abs(places).max(axis=1).sum()) + reach
    return APART if np.abs(places[0] - places[1]).max() > 4.0 * reach + ROOM * away else EVERY_FACE


def _pair_claims(
    book: _Book, oracle: Detection, motion: Motion, stage: ContainmentStage, column: int
) -> NDArray[np.int64]:  # fmt: skip
    """The claims about one pair, equal ones of consecutive frames joined."""
    verdict = oracle.verdict[:, column]
    i, j = oracle.pairs[column].tolist()
    why = np.zeros((len(verdict), 4), dtype=np.int64)
    why[:, 0] = verdict
    apart = np.flatnonzero((verdict == Verdict.CLEAR) | (verdict == Verdict.CONTAINED))
    turns, places = (values[apart[:, None], [i, j]] for values in (motion.rotations, motion.translations))
    why[apart, 1] = book.of(i, j, turns, places)
    inside = np.flatnonzero(verdict == Verdict.CONTAINED)
    if len(inside):
        why[inside, 2:] = corners_inside(stage, motion.take(inside), column)
    touching = np.flatnonzero(verdict == Verdict.CONTACT)
    if len(touching):
        why[touching, 2:] = _witnesses(oracle, touching, column)
    begin = np.flatnonzero(np.concatenate([[True], (why[1:] != why[:-1]).any(axis=1)])) if len(why) else touching
    end = np.concatenate([begin[1:], [len(why)]]) - 1 if len(begin) else begin
    return np.column_stack([np.full(len(begin), column), begin, end, why[begin]])


def _witnesses(oracle: Detection, frames: IntArray, column: int) -> IntArray:
    """Two faces that meet in each of these frames, (K, 2); the same two for as many frames on end as possible."""
    sets = oracle.face_sets
    assert sets is not None
    entries = np.flatnonzero(sets.pair == column)
    keys = sets.faces[:, 0].astype(np.int64) << 32 | sets.faces[:, 1]
    found, begin, common = np.empty(len(frames), dtype=np.int64), 0, np.zeros(0, dtype=np.int64)
    for k, entry in enumerate(entries.tolist()):
        now = keys[sets.start[entry] : sets.stop[entry]]
        still = common[np.isin(common, now, assume_unique=True)]
        if not len(still):
            found[begin:k], begin, still = common[:1].sum(), k, now
        common = still
    found[begin:] = common[0]
    return np.column_stack([found >> 32, found & 0xFFFFFFFF])


def _given(result: RunResult, known: ProofPoses) -> tuple[IntArray, FloatArray]:
    """Poses that the recording alone does not give: rows (g, 4), poses (g, 12); equal ones on end are one."""
    motion, origin = result.assembly.motion, result.assembly.origin
    rows, poses = [np.zeros((0, 4), dtype=np.int64)], [np.zeros((0, 12))]
    for body in range(motion.body_count):
        turn, place = motion.rotations[:, body].reshape(-1, 9), motion.translations[:, body]
        pose, valid = np.concatenate([turn, place], axis=1), motion.valid[:, body]
        theirs = np.concatenate([known.rotation[:, body].reshape(-1, 9), known.translation[:, body]], axis=1)
        given = (known.valid[:, body] != valid) | (valid & (pose != theirs).any(axis=1))
        held = origin[:, body] == PoseOrigin.HELD
        word = np.where(valid, np.where(held, PoseOrigin.HELD, PoseOrigin.INTERPOLATED), PoseOrigin.NONE)
        pose[~valid] = 0.0
        fresh = np.concatenate([[True], (pose[1:] != pose[:-1]).any(axis=1) | (word[1:] != word[:-1])])
        fresh[1:] |= ~given[:-1]
        begin = np.flatnonzero(given & fresh)
        number = np.cumsum(given & fresh) - 1
        last = np.full(len(begin), -1)
        np.maximum.at(last, number[given], np.flatnonzero(given))
        rows.append(np.column_stack([np.full(len(begin), body), begin, last, word[begin]]))
        poses.append(pose[begin])
    return np.concatenate(rows), np.concatenate(poses)
