import io

import numpy as np
from PIL import Image

from replay.outputs.camera import Eye
from replay.outputs.report.bench_picture import bench_picture


def pixels(png):
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def seen(run, **options):
    miss = run.misses["slow"][0]
    x, y, z = miss.point
    eye = Eye((x + 0.05, y + 0.1, z + 0.6), miss.point)
    return pixels(bench_picture(run.assembly, run.session.scene, miss.deepest, eye, **options))


def test_bodies_are_seen_and_marked_faces_are_red(run):
    plain = seen(run)
    assert len(np.unique(plain.reshape(-1, 3), axis=0)) > 5
    marked = seen(run, marked={k: np.arange(len(body.mesh.faces)) for k, body in enumerate(run.assembly.bodies)})
    red = (marked[..., 0] > 100) & (marked[..., 1] < 0.35 * marked[..., 0])
    assert red.sum() > 200 and not ((plain[..., 0] > 100) & (plain[..., 1] < 0.35 * plain[..., 0])).any()


def test_a_body_without_a_pose_is_not_drawn(run):
    from dataclasses import replace

    motion = run.assembly.motion
    gone = type(motion)(motion.times, motion.translations, motion.rotations, np.zeros_like(motion.valid))
    empty = replace(run, assembly=replace(run.assembly, motion=gone))
    assert len(np.unique(seen(empty).reshape(-1, 3), axis=0)) == 1
