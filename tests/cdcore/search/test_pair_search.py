"""The search finds only faces that meet, repeats itself to the bit, and with budget enough finds everything.

A search looks for a pair of faces of two bodies that meets (a hit), at the poses of both; the curve of a hit is the
pairs that meet and hang together with it.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from support.search_scenes import I3, NO_SEEDS, ball_of, colliding_poses, exact_pairs, search_of, torus_mesh
from support.shapes import box_mesh, random_rotations

from cdcore import TriangleMesh

VARIANTS = ["memetic", "corrected", "local", "random"]
"""Of the search; "printed" is that of the paper, whose equations break."""
AT_ORIGIN = (I3, np.zeros(3))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("variant", [*VARIANTS, "printed"])
def test_hits_and_their_curves_are_in_the_exact_set(variant):
    """Twelve poses in which a ball collides with a torus; ``intersecting_faces`` lists the face pairs that meet.

    Some search has a hit, but for the printed equations, which may have none.
    """
    torus, ball = torus_mesh(), ball_of(faces=800, radius=0.5)
    search = search_of(torus, ball, variant=variant, budget=5000)
    hits = 0
    for stamp, pose in enumerate(colliding_poses(torus, ball, count=12, seed=5)):
        query = search.search(pose, AT_ORIGIN, stamp)
        meeting = exact_pairs(search, torus, ball, pose, AT_ORIGIN)
        if query.hit is not None:
            hits += 1
            assert query.hit in meeting, stamp
            assert {tuple(row) for row in search.curve(NO_SEEDS).tolist()} <= meeting, stamp
    assert hits > 0 or variant == "printed"


@pytest.mark.parametrize("variant", VARIANTS)
def test_on_tiny_meshes_an_exhaustive_budget_finds_everything(variant):
    """Two cubes of 12 faces in twelve random poses; the search goes on after each hit until there is none.

    Each pair of faces that meets is a hit once.
    """
    cube, rng = box_mesh(), np.random.default_rng(2)
    search = search_of(cube, cube, variant=variant, budget=20_000, stop_first=False)
    for stamp, rotation in enumerate(random_rotations(rng, 12)):
        pose = rotation, rng.uniform(-0.9, 0.9, 3)
        hits, query = [], search.search(pose, AT_ORIGIN, stamp)
        while query.hit is not None:
            hits.append(query.hit)
            query = search.search_further()
        assert sorted(hits) == sorted(exact_pairs(search, cube, cube, pose, AT_ORIGIN)), stamp


@pytest.mark.sampled(2)
@pytest.mark.parametrize("variant", VARIANTS)
def test_equal_seeds_give_equal_queries_in_any_thread(variant):
    """Eight poses at seconds 0 to 7: by a new search each, one after the other and in four threads.

    Then by a single search, backwards.
    """
    ball = ball_of(faces=800)
    poses = colliding_poses(ball, ball, count=8, seed=7)

    def query_at(stamp):
        return search_of(ball, ball, variant=variant, budget=4000).search(poses[stamp], AT_ORIGIN, stamp)

    in_order = [query_at(stamp) for stamp in range(8)]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(query_at, range(8))) == in_order
    search = search_of(ball, ball, variant=variant, budget=4000)
    backwards = [search.search(poses[stamp], AT_ORIGIN, stamp) for stamp in reversed(range(8))]
    assert backwards[::-1] == in_order


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize(
    ("height", "hit"), [pytest.param(0.0, (0, 0), id="on itself"), pytest.param(1e-300, None, id="1e-300 m above")]
)
def test_degenerate_and_smallest_input_is_searched_all_the_same(variant, height, hit):
    """Two meshes of one face that is a point: they meet only in the same place."""
    point = TriangleMesh([[0, 0, 0]], [[0, 0, 0]])
    search = search_of(point, point, variant=variant, budget=10)
    assert search.search((I3, np.array([0, 0, height])), AT_ORIGIN, stamp=0.0).hit == hit


@pytest.mark.parametrize("scale", [2.0**-600, 2.0**400], ids=["2^-600", "2^400"])
def test_sizes_beyond_the_compiled_predicate_are_decided_by_integers(scale):
    """Cubes of 1 m overlap at an offset of (0.75, 0.5, 0.25) m and not at 1.5 m, whatever power of two scales them."""
    cube = TriangleMesh(box_mesh().vertices * scale, box_mesh().faces)
    search = search_of(cube, cube, variant="local", budget=2000)
    overlapping, separate = (I3, np.array([0.75, 0.5, 0.25]) * scale), (I3, np.array([1.5, 0, 0]) * scale)
    hit = search.search(overlapping, AT_ORIGIN, stamp=0.0).hit
    assert hit in exact_pairs(search, cube, cube, overlapping, AT_ORIGIN)
    assert search.search(separate, AT_ORIGIN, stamp=0.0).hit is None


@pytest.mark.parametrize("variant", VARIANTS)
def test_start_at_a_meeting_pair_hits_immediately(variant):
    """Two balls of radius 1 m, 1.5 m apart: a search that starts at a face pair that meets evaluates only that."""
    ball, pose = ball_of(faces=800), (I3, np.array([1.5, 0.1, 0.2]))
    search = search_of(ball, ball, variant=variant, budget=100_000)
    start = min(exact_pairs(search, ball, ball, pose, AT_ORIGIN))
    query = search.search(pose, AT_ORIGIN, stamp=0.0, start=start)
    assert (query.hit, query.evaluations) == (start, 1)
    assert (int(search.state["start_a"]), int(search.state["start_b"])) == start


@pytest.mark.parametrize(("local", "world"), [(0.0, 0.0), (1e3, 0.0), (0.0, 1e6), (1e3, 1e3)])
def test_touching_faces_are_never_skipped_wherever_they_lie(local, world):
    """Two thin triangles share one corner, at which the balls round them are tangent: one evaluation is a hit.

    200 poses, the same for both bodies, so that the corner stays shared to the bit. ``local``: metres from the bodies'
    origin to that corner, ``world``: from the world's origin to the bodies.
    """
    rng = np.random.default_rng(3)
    corner = np.array([local, 0.0, 0.0])
    triangle = np.array([[0, 0, 0], [0.5, 0.01, 0], [0.5, -0.01, 0]])
    meshes = [TriangleMesh(corner + side * triangle, [[0, 1, 2]]) for side in (1.0, -1.0)]
    search = search_of(*meshes, variant="random", budget=1)
    for rotation in random_rotations(rng, 200):
        pose = rotation, rng.normal(size=3) * world
        assert search.search(pose, pose, stamp=0.0).hit == (0, 0)
