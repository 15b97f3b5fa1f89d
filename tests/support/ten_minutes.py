"""Ten minutes of twelve bodies of 5,000 faces: what an audit of ordinary length is."""

import numpy as np

from sessions import Scene, Session, Track
from sessions.synthetic.bench import Instruments, Placed
from sessions.synthetic.scenes import make_scene_session

MINUTES, FACES = 10, 5000


def ten_minutes():
    """The minute of bumps ten times over, two more glasses beside it, everything paired that moves."""
    minute, _ = make_scene_session("bench-bumps", faces=FACES)
    spare = {
        "spare-beaker": Placed("beaker_250", (0.35, 0.9001, 0.15)),
        "spare-flask": Placed("erlenmeyer_flask", (0.02, 0.9001, -0.20)),
    }
    layout = Instruments(spare, FACES)
    tracks = {name: repeated(track) for name, track in minute.tracks.items()}
    stamps = tracks["headset"].times_ns
    for name, item in spare.items():
        poses = (np.tile(row, (len(stamps), 1)) for row in (item.position, item.quaternion))
        tracks[name] = Track(stamps, *poses)
    scene = Scene("ten-minutes", (*minute.scene.bodies, *layout.bodies()))
    return Session.from_tracks(tracks, meshes={**minute.meshes, **layout.meshes}, scene=scene)


def repeated(track):
    times = track.times_ns
    span = times[-1] - times[0] + int(np.median(np.diff(times)))
    poses = (np.concatenate([part] * MINUTES) for part in (track.positions, track.quaternions_xyzw, track.valid))
    return Track(np.concatenate([times + k * span for k in range(MINUTES)]), *poses)
