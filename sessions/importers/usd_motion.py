"""A USD scene whose transforms have time samples: bodies, meshes, colliders, pairs that never meet, and poses."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from sessions.errors import ImportFileError
from sessions.importers.ledger import Ledger, increasing_rows
from sessions.importers.scene_motion import session_of_scene
from sessions.model.session import Session, Track
from sessions.scene_formats.safe_files import SceneFiles
from sessions.scene_formats.scene_source import Surface
from sessions.scene_formats.usd_physics import read_usd_motion


def read_usd(source: Path, root: str | Path = "", surface: str = Surface.AUTO) -> Session:
    """The session of a USD scene, in the canonical frame; time 0 is that of the first sample.

    Parameters
    ----------
    root : the folder that all files of the scene lie in; ``""``: that of the scene.
    surface : ``auto``, ``drawn`` or ``colliding``: the prims that are the surface of a body.

    Raises ``ImportFileError``: no body moves; ``SceneSourceError``: as `read_scene_source` says.
    """
    files = SceneFiles(Path(root) if root else source.parent)
    scene, motions = read_usd_motion(source, files, Surface(surface))
    motions = {name: motion for name, motion in motions.items() if name in scene.bodies}
    if not motions:
        left_out = "".join(f"; not taken: {sentence}" for sentence in scene.left_out)
        raise ImportFileError(
            f"{source} has no body that collides and whose transforms have time samples{left_out}; take the scene for "
            f'a recording of poses instead: [scene] from = "{source.name}"'
        )
    ledger, tracks = Ledger(source), {}
    start = min(float(motion.seconds[0]) for motion in motions.values())
    for name, motion in motions.items():
        stamps = np.round((motion.seconds - start) * 1e9).astype(np.int64)
        keep = increasing_rows(name, stamps, (motion.poses.reshape(len(stamps), -1),), ledger)
        rotations = Rotation.from_matrix(scene.rotation @ motion.poses[keep, :3, :3])
        positions = motion.poses[keep, :3, 3] @ scene.rotation.T
        tracks[name] = Track(stamps[keep], positions, rotations.as_quat())
    clock = "time codes of the scene, from the first sample"
    return session_of_scene(scene, tracks, ledger, name=source.stem, clock=clock, surface=Surface(surface))
