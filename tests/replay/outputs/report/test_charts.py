"""Charts, plots and pictures of the page."""

import base64
import io
import re

import numpy as np
from PIL import Image
from support.small_worlds import along_x, cube, cubes

from replay.outputs.camera import FIELD_OF_VIEW, Eye
from replay.outputs.report.bench_picture import HIGH, WIDE, _covered, bench_picture
from replay.outputs.report.charts import timeline, timing
from replay.outputs.report.page import report_html
from replay.pipeline.engine import compute
from sessions import MeshData, Session
from sessions.model.scene import Scene, SceneBody


def test_every_miss_has_its_number(run):
    assert numbers_in(timeline(run, "slow")) == [miss.number for miss in run.misses["slow"]]


def numbers_in(text):
    boxes = [box.split("-") for box in re.findall(r'class="miss">([0-9-]+)<', text)]
    return [number for box in boxes for number in range(int(box[0]), int(box[-1]) + 1)]


def test_the_plot_names_each_detector_and_the_budget(run):
    text = timing(run)
    assert "slow, frame by frame" in text and "exact, mean of the whole motion" in text and "11.1 ms" in text
    assert timing(run) == text


def pixels(png):
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def seen(run, **options):
    miss = run.misses["slow"][0]
    x, y, z = miss.point
    eye = Eye((x + 0.05, y + 0.1, z + 0.6), miss.point)
    return pixels(bench_picture(run.assembly, run.session.scene, miss.deepest, eye, **options))


def furnished(places, sizes):
    """Boxes of these edges at these places, the first a dark bench, seen by nobody."""
    tags = [("bench",), *[("porcelain",)] * (len(sizes) - 1)]
    meshes = {f"b{k}": MeshData(cube().vertices * size, cube().faces) for k, size in enumerate(sizes)}
    scene = Scene(bodies=tuple(SceneBody(f"b{k}", tags=one) for k, one in enumerate(tags)))
    poses = {f"b{k}": (np.tile(place, (2, 1)), along_x([0.0] * 2)[1]) for k, place in enumerate(places)}
    return compute(Session.from_arrays(np.arange(2) * 10_000_000, poses, meshes, scene), detectors=())


def warm(result, eye):
    """Pixels of what is no bench and no background: both are bluish."""
    picture = pixels(bench_picture(result.assembly, result.session.scene, 0, eye))
    return int((picture[..., 0] > picture[..., 2] + 2).sum())


def test_what_is_below_a_bench_does_not_shine_through_it_however_long_its_triangles_are():
    top, legs = (0.0, 0.01, 0.0), [(x, -0.03, z) for x in (-0.9, 0.9) for z in (-0.4, 0.4)]
    leg = (0.1, 0.05, 0.1)
    eye = Eye((0.3, 1.5, 0.6), (0.0, 0.0, 0.0))
    alone = furnished([(9.0, 9.0, 9.0), *legs], [(0.01, 0.01, 0.01), *[leg] * 4])
    assert warm(furnished([top, *legs], [(2.0, 0.02, 1.0), *[leg] * 4]), eye) < 0.02 * warm(alone, eye) > 20


def test_a_false_contact_shows_in_yellow_what_invents_it_and_the_whole_pair():
    apart = cubes({"a": [0.0] * 6, "b": [3.0, 1.02, 1.01, 1.02, 3.0, 3.0]})
    result = compute(apart, detectors="c=collider[shape=box,skin_m=0.05]")
    page = report_html(result)
    assert "False contact 1 of c: a-b for 3 frames from 0.010 s: colliders meet" in page
    assert page.index("; yellow: the solids") < page.index("</header>")
    seen = pixels(base64.b64decode(re.search('image/png;base64,([^"]+)"', page)[1]))
    r, g, b = np.moveaxis(seen, -1, 0)
    rim = (r > 180) & (np.abs(r - 1.25 * g) < 12) & (b < 30)
    assert rim.sum() > 500
    rows, columns = np.nonzero(rim)
    assert rows.min() > 0 and columns.min() > 0 and rows.max() < len(seen) - 1 and columns.max() < seen.shape[1] - 1


def test_a_triangle_covers_the_pixels_whose_rays_meet_it_at_their_depth():
    rng = np.random.default_rng(3)
    local = rng.uniform([-1, -0.6, -3], [1, 0.6, -0.5], (8, 3, 3))
    found = [np.concatenate(one) for one in zip(*_covered(local), strict=True)]
    y, x = np.divmod(np.arange(WIDE * HIGH), WIDE)
    focus = HIGH / 2 / np.tan(FIELD_OF_VIEW / 2)
    across, up = (x + 0.5 - WIDE / 2) / focus, -(y + 0.5 - HIGH / 2) / focus
    rays = np.stack([across, up, -np.ones(len(x))], axis=1)
    for number, (a, b, c) in enumerate(local):
        # a point s a + t b + u c on a ray, by Cramer's rule: the shares are scaled volumes, of one sign inside
        shares = np.stack([rays @ np.cross(b, c), rays @ np.cross(c, a), rays @ np.cross(a, b)], axis=1)
        shares *= np.sign(np.linalg.det([a, b, c]))
        clear = np.abs(shares).min(axis=1) > 1e-9
        inside = np.flatnonzero((shares > 0).all(axis=1) & clear)
        mine = found[0] == number
        assert set(inside) <= set(found[1][mine]) <= set(inside) | set(np.flatnonzero(~clear))
        depth = abs(np.linalg.det([a, b, c])) / shares[found[1][mine]].sum(axis=1)
        assert np.allclose(1 / found[2][mine], depth, rtol=1e-9)
