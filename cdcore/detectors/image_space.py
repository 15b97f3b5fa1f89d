"""Layered depth images: samples how much two solids overlap. It lists no faces and does not decide open meshes."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from cdcore.broad.broad_phase import BroadPhase
from cdcore.containment.closed_parts import parity_is_inside
from cdcore.image_space.overlap import MOST_PIXELS, NOTHING, Overlap, overlap_of_placed
from cdcore.mesh import TriangleMesh
from cdcore.narrow.pair_frames import Poses, ask_changed_poses
from cdcore.numerics import FloatArray, IntArray
from cdcore.poses import place_points
from cdcore.protocol import Body, Detection, Motion, PairDetector, Verdict
from cdcore.protocol.settings import CheckedSettings, whole


@dataclass(frozen=True, kw_only=True)
class ImageSpaceSettings(CheckedSettings):
    """``resolution``: pixels along the longest side of the window that two bodies' boxes share."""

    resolution: int = whole(32, 1, MOST_PIXELS)


class ImageSpaceDetector(PairDetector[ImageSpaceSettings]):
    """Sends rays along three axes through where the boxes of two solids overlap, and adds up what both share.

    What it calls CONTACT or CONTAINED overlaps in truth; an overlap that no ray meets is NOT_FOUND. CONTAINED is where
    every connected part of one body is wholly inside the other or wholly beside it, as far as rays tell. Where boxes
    overlap and rays cannot tell the inside of a mesh (holes, doubled faces, parts that overlap) the answer is INVALID.

    Cost: all faces of both bodies, three times, in each pose whose boxes overlap.
    """

    name = "image-space"
    stages = ("spheres", "images")
    Settings = ImageSpaceSettings
    sources = (
        "B. Heidelberger, M. Teschner, M. Gross, Real-time volumetric intersections of deforming objects, Vision, "
        "Modeling and Visualization 2003",
        "B. Heidelberger, M. Teschner, M. Gross, Detection of collisions and self-collisions using image-space "
        "techniques, WSCG 2004",
    )
    choose_when = "you compare with a method that samples solids in image space"
    cannot = "name faces, see overlaps between its rays, or speak of open meshes"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: ImageSpaceSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._broad = BroadPhase(bodies, pairs, boxes=False)

    def _run(self, motion: Motion, _memory: None, _faces: bool) -> Detection:
        near = self._broad.candidates(motion)
        verdict, frames, columns, clock = near.verdict, near.frames, near.columns, near.clock
        reasons: dict[tuple[int, int], str] = {}
        work = near.work | {"images": 0, "rays": 0, "layers": 0}

        def ask(column: int, pose_a: Poses, pose_b: Poses) -> list[tuple[Overlap, Verdict, str]]:
            pair = self.pairs[column].tolist()
            return [self._overlap(pair, placed) for placed in zip(*pose_a, *pose_b, strict=True)]

        answers, which = ask_changed_poses(motion, self.pairs, frames, columns, ask)
        for overlap, _, _ in answers:
            work["images"] += 1
            work["rays"] += overlap.rays
            work["layers"] += overlap.layers
        for frame, column, answer in zip(frames.tolist(), columns.tolist(), which.tolist(), strict=True):
            _, verdict[frame, column], why = answers[answer]
            if why:
                reasons[frame, column] = why
        clock.append(perf_counter())
        return self._detection(
            motion,
            verdict,
            containment=("refused: depth images are sampled",) * len(self.pairs),
            work=work,
            seconds=self._seconds(clock),
            approximate=True,
            reasons=reasons,
        )

    def _overlap(self, pair: list[int], poses: tuple[FloatArray, ...]) -> tuple[Overlap, Verdict, str]:
        """Returns the overlap that rays saw at two placed poses, the verdict, and why it is INVALID."""
        triangles = [self.bodies[body].mesh.triangles for body in pair]
        placed = [place_points(triangles[0], *poses[:2]), place_points(triangles[1], *poses[2:])]
        lower, upper = (
            [corners.min(axis=(0, 1)) for corners in placed],
            [corners.max(axis=(0, 1)) for corners in placed],
        )
        if (lower[0] > upper[1]).any() or (lower[1] > upper[0]).any():
            return NOTHING, Verdict.CLEAR, ""
        refusals = sorted(
            f"{self.bodies[body].name} {why}" for body in pair if (why := _refusal(self.bodies[body].mesh))
        )
        if refusals:
            return NOTHING, Verdict.INVALID, " and ".join(refusals)
        overlap = overlap_of_placed(placed[0], placed[1], self.settings.resolution)
        if overlap.volume <= 0.0:
            return overlap, Verdict.NOT_FOUND, ""
        contained = overlap.inside >= 0 or any(
            self._components_are_inside_or_beside(pair[body], placed[body], placed[1 - body]) for body in (0, 1)
        )
        return overlap, Verdict.CONTAINED if contained else Verdict.CONTACT, ""

    def _components_are_inside_or_beside(self, body: int, own: FloatArray, other: FloatArray) -> bool:
        """Whether each connected part of a body lies wholly inside another one or wholly beside it, and one inside.

        ``own`` (f, 3, 3) and ``other`` (g, 3, 3) are placed faces. A body of one part was asked about already.
        """
        labels = self.bodies[body].mesh.components
        components = np.unique(labels)
        if len(components) == 1:
            return False
        inside = 0
        for component in components:
            overlap = overlap_of_placed(own[labels == component], other, self.settings.resolution)
            if overlap.volume > 0.0 and overlap.inside != 0:
                return False
            inside += overlap.inside == 0
        return inside > 0


def _refusal(mesh: TriangleMesh) -> str:
    """Why rays cannot tell the inside of a mesh, as a verb and its object; "" where they can."""
    if not mesh.is_closed:
        return "is open: it has no inside to overlap"
    if not parity_is_inside(mesh):
        return "has faces drawn twice, or parts that cross or lie in each other: rays do not tell its inside"
    return ""
