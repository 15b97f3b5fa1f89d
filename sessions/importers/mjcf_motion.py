"""A model of MuJoCo with joint angles over time: bodies, meshes, colliders, pairs that never meet, and poses."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from sessions.errors import ImportFileError
from sessions.importers.ledger import POSES, Ledger, increasing_rows
from sessions.importers.scene_motion import session_of_scene
from sessions.model.session import Session, Track
from sessions.scene_formats.joint_motion import body_poses, posed_bodies, read_joint_motion
from sessions.scene_formats.mjcf import body_names, load_model, scene_of
from sessions.scene_formats.safe_files import SceneFiles
from sessions.scene_formats.scene_source import Surface


def read_mjcf(source: Path, motion: str | Path = "", root: str | Path = "", surface: str = Surface.AUTO) -> Session:
    """The session of an MJCF and the joint motion beside it, in the canonical frame.

    Parameters
    ----------
    motion : .npz or .csv of joint angles; ``""``: the file of the model's name beside it.
    root : the folder that all files of the model lie in; ``""``: that of the model.
    surface : ``auto``, ``drawn`` or ``colliding``: the geoms that are the surface of a body.

    Raises ``ImportFileError``: there is no motion; ``SceneSourceError``: as `read_scene_source` says.
    """
    model = load_model(source, SceneFiles(Path(root) if root else source.parent))
    scene = scene_of(model, Surface(surface))
    joints = read_joint_motion(_motion_of(source, motion), model)
    ledger, notes = Ledger(source), [*joints.notes]
    stamps = np.round((joints.seconds - joints.seconds[0]) * 1e9).astype(np.int64)
    keep = increasing_rows("joint motion", stamps, (joints.configurations,), ledger)
    configurations = joints.configurations[keep]
    moving = [name for name, body in scene.bodies.items() if body.moves]
    names = body_names(model)
    bodies = [names.index(name) for name in moving]
    positions, quaternions = body_poses(model, configurations, bodies)
    valid = posed_bodies(model, configurations, bodies)
    tracks = {}
    for column, name in enumerate(moving):
        rotations = scene.rotation @ Rotation.from_quat(quaternions[:, column][:, [1, 2, 3, 0]]).as_matrix()
        tracks[name] = Track(
            stamps[keep],
            positions[:, column] @ scene.rotation.T,
            Rotation.from_matrix(rotations).as_quat(),
            valid[:, column],
        )
        kept = int(valid[:, column].sum())
        lost = {"below a joint that has no position": len(valid) - kept}
        ledger.book(POSES, name, read=len(valid), kept=kept, dropped=lost)
    scene = replace(scene, notes=(*scene.notes, *notes))
    clock = "time of the motion, from its first row"
    return session_of_scene(scene, tracks, ledger, name=source.stem, clock=clock, surface=Surface(surface))


def _motion_of(source: Path, motion: str | Path) -> Path:
    if motion:
        return Path(motion)
    for ending in (".npz", ".csv"):
        if source.with_suffix(ending).is_file():
            return source.with_suffix(ending)
    raise ImportFileError(f"{source} has no joint motion beside it; name one: --motion FILE.npz")
