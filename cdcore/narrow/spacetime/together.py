"""All pairs of a short motion in one call of the kernel: what is set up for a pair is an entry of a few arrays.

Choose it where poses are known throughout and change in every frame; a ``PairJob`` answers any pair, to the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from cdcore.narrow.spacetime.block import BlockQuestion
from cdcore.narrow.spacetime.bounds import LARGEST_SIZE, LARGEST_SKEW, SMALLEST_SIZE, position_pad
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.pair_job import KEY_BITS, face_bits
from cdcore.narrow.spacetime.pose_lanes import Tracks
from cdcore.narrow.spacetime.traverse import Settle, Workspace
from cdcore.numerics import ByteArray, IntArray


def search_together(
    trees: Sequence[BoxTree], pairs: IntArray, tracks: Tracks, faces: bool, workspace: Workspace,
    settle: Settle, marks: ByteArray, work: IntArray,
) -> tuple[IntArray, Iterator[tuple[int, IntArray]]]:  # fmt: skip
    """Columns of the pairs (P, 2) that are searched, and an iteration that does it, over all T frames.

    Fills ``marks`` (P, 2, T) and adds to ``work`` as a ``PairJob`` does; yields columns whose faces were asked for and
    meet, and their keys. ``settle`` is given columns.
    """
    bodies, ends, (size, skew, restless) = tracks.bodies.tolist(), tracks.ends, tracks.found.T
    first, second = np.searchsorted(tracks.bodies, pairs).T
    # the smaller body is moved into the larger one's frame
    turned = ends[first, 15] > ends[second, 15]
    a, b = np.where(turned, second, first), np.where(turned, first, second)
    whole, off = ends[a, 16] + ends[b, 16] + (size[a] + size[b]), skew[a] + skew[b]
    bits = np.array([face_bits(trees[body]) for body in bodies])
    searched = (whole >= SMALLEST_SIZE) & (whole <= LARGEST_SIZE) & (off <= LARGEST_SKEW)
    frames, room = marks.shape[2], 1 << np.maximum(0, KEY_BITS - bits[a] - bits[b])
    searched &= (restless[a] + restless[b] > 0.0) & (room >= frames)
    columns, nodes = np.flatnonzero(searched), np.array([trees[body].row for body in bodies])
    workspace.make_room([trees[body] for body in bodies])
    question = BlockQuestion(0, frames, 0.0, faces, bits[a], bits[b])
    rows = workspace.rows_of((nodes[a], nodes[b]), (tracks.rows[a], tracks.rows[b]), question, marks, work)
    pads = position_pad(whole, off)[columns]
    found = workspace.traverse_all(rows[columns], pads, lambda row, keys: settle(int(columns[row]), keys))
    return columns, ((int(columns[k]), keys) for k, keys in found)
