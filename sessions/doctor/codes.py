"""Everything the doctor can find: what each code means and what cures it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class CodeSpec:
    """One code.

    Parameters
    ----------
    group : ``structure``, ``time``, ``pose``, ``scale``, ``mesh`` or ``scene``.
    meaning : what it means for whoever looks at the recording.
    fix : what to do about it.
    """

    group: str
    meaning: str
    fix: str


_RECOVER = "save what is readable with `replay recover`"
_AGAIN = "export the session again from the program that made it"
_TRACKER = "run with --policy to choose what stands in for it, and look at line of sight and base stations"

CODES: Final[dict[str, CodeSpec]] = {
    # structure
    "not-mcap": CodeSpec("structure", "the file is no MCAP", "bring other formats in with `replay import`"),
    "torn": CodeSpec("structure", "the recording was cut short and has no index", _RECOVER),
    "unreadable": CodeSpec("structure", "the file cannot be walked to its end", _RECOVER),
    "damaged-chunk": CodeSpec("structure", "everything recorded in this chunk is lost to a reader", _RECOVER),
    "bad-message": CodeSpec("structure", "poses in this chunk are not what their schema says", _RECOVER),
    "data-crc": CodeSpec("structure", "bytes changed after the file was written", "copy the original again"),
    "damaged-attachment": CodeSpec("structure", "a mesh or the scene changed after it was written", "copy it again"),
    "index-missing": CodeSpec("structure", "readers must walk the whole file", "rewrite it with `replay recover`"),
    "index-wrong": CodeSpec(
        "structure", "readers that trust the index miss messages", "rewrite it with `replay recover`"
    ),
    "unordered-chunks": CodeSpec(
        "structure", "readers in file order see time run backwards", "rewrite it with `replay recover`"
    ),
    "unknown-version": CodeSpec("structure", "this program may misread the file", "install the version it asks for"),
    "no-poses": CodeSpec("structure", "there is nothing to replay", "write foxglove.FrameTransforms on /tf"),
    # time
    "time-backwards": CodeSpec("time", "frames lie before frames already recorded; a run leaves them out", _AGAIN),
    "duplicate-stamps": CodeSpec(
        "time", "several samples claim one moment; a run keeps the first", "check that the recorder stamps each sample"
    ),
    "gap": CodeSpec(
        "time",
        "nobody knows what happened in between",
        "do not read contact-free time across it; record at a lower load",
    ),
    "uneven-steps": CodeSpec(
        "time", "the rate is a median, not a clock", "take time from stamps, never from frame numbers"
    ),
    "clock-skew": CodeSpec(
        "time",
        "the two clocks of this recording disagree; things recorded on one are misplaced on the other",
        "synchronise the clocks and state the offset in the session's facts",
    ),
    "clock-drift": CodeSpec(
        "time", "one clock runs faster; the offset holds for a moment only", "synchronise clocks while recording"
    ),
    # pose
    "not-finite": CodeSpec("pose", "the sample is no pose", _TRACKER),
    "zero-quaternion": CodeSpec("pose", "the sample has no rotation; many engines take it as none", _TRACKER),
    "non-unit-quaternion": CodeSpec(
        "pose", "the rotation is scaled; engines that do not notice stretch the mesh", "normalise it in the exporter"
    ),
    "off-unit-quaternion": CodeSpec("pose", "the rotation was rounded; a run renormalises it", "export more digits"),
    "identity-while-lost": CodeSpec(
        "pose", "the tracker lost the body and wrote the origin instead, as a valid pose", _TRACKER
    ),
    "tracking-lost": CodeSpec("pose", "the tracker said that it had lost the body; there is no pose", _TRACKER),
    "frozen": CodeSpec("pose", "the position stood still because nothing was measured", _TRACKER),
    "at-rest": CodeSpec("pose", "the pose repeats to the last bit: at rest, and without tracker noise", "nothing"),
    "teleport": CodeSpec("pose", "the body did not get there by moving; the path in between is unknown", _TRACKER),
    "sign-flips": CodeSpec("pose", "q and -q alternate: the same rotation", "nothing; interpolate on the shorter arc"),
    "rounded-rotations": CodeSpec("pose", "rotations were printed with few decimals", "export more digits"),
    # scale and frame
    "unit-suspect": CodeSpec(
        "scale", "positions look like millimetres or centimetres, not metres", "import with the right unit"
    ),
    "handedness": CodeSpec("scale", "left and right seem to be swapped", "import with the source's handedness"),
    "up-axis": CodeSpec("scale", "the head stands upright along another axis than +Y", "import with the source's axes"),
    "head-below-hands": CodeSpec(
        "scale", "the head is lower than the hands most of the time", "check the up axis and the roles of the devices"
    ),
    # meshes
    "mesh-hash": CodeSpec("mesh", "the mesh is not the one that was recorded", "put the recorded mesh back"),
    "mesh-unreadable": CodeSpec("mesh", "the mesh cannot be used", "export it again as triangles"),
    "mesh-empty": CodeSpec("mesh", "the mesh has no triangle", "export the surface as triangles"),
    "mesh-degenerate": CodeSpec("mesh", "faces without area confuse most engines", "remove them in a mesh editor"),
    "mesh-duplicate": CodeSpec("mesh", "faces are counted twice", "remove doubles in a mesh editor"),
    "mesh-non-manifold": CodeSpec("mesh", "it has no inside: nothing can be found contained", "repair the edges"),
    "mesh-open": CodeSpec("mesh", "the surface has holes: nothing can be found inside it", "close it if it is solid"),
    "mesh-winding": CodeSpec("mesh", "neighbouring faces disagree which side is out", "recalculate normals outside"),
    "mesh-mirrored": CodeSpec(
        "mesh", "the mesh is inside out: mirrored, or wound the wrong way", "export it with the right handedness"
    ),
    "mesh-units": CodeSpec("mesh", "its size is not that of a thing on a bench", "set scale in the scene"),
    # scene
    "bad-scene": CodeSpec("scene", "what was declared cannot be read", "correct the scene"),
    "unknown-frame": CodeSpec(
        "scene", "poses are given in a frame, or for a body, that the file does not know", "name it, or leave it out"
    ),
    "unrecorded-body": CodeSpec("scene", "it is declared or paired but was never recorded", "record it, or remove it"),
    "no-mesh": CodeSpec("scene", "it moves but has no mesh, so no contact of it is found", "give it a mesh"),
    "undeclared-body": CodeSpec("scene", "it was recorded but the scene does not speak of it", "declare it"),
    "proxy": CodeSpec("scene", "its mesh only stands in for the real one", "say so beside every contact of it"),
}
"""Code -> what it means; in the order in which findings of one severity are listed."""
