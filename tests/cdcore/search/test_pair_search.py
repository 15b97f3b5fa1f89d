"""The search invents nothing, repeats itself to the bit, and with budget enough finds everything."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from support.search_scenes import I3, NO_SEEDS, ball_of, colliding_poses, exact_pairs, search_of, torus_mesh
from support.shapes import box_mesh, random_rotations

from cdcore import TriangleMesh, intersecting_faces

VARIANTS = ["memetic", "corrected", "local", "random"]
AT_ORIGIN = (I3, np.zeros(3))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("variant", [*VARIANTS, "printed"])
def test_hits_and_their_curves_are_in_the_exact_set(variant):
    """Twelve poses in which a ball collides with a torus; the printed equations may find none."""
    torus, ball = torus_mesh(), ball_of(faces=800, radius=0.5)
    search = search_of(torus, ball, variant=variant, budget=5000)
    hits = 0
    for stamp, pose in enumerate(colliding_poses(torus, ball, count=12, seed=5)):
        query = search.search(pose, AT_ORIGIN, stamp)
        truth = exact_pairs(search, torus, ball, pose, AT_ORIGIN)
        if query.hit is not None:
            hits += 1
            assert query.hit in truth
            assert {tuple(row) for row in search.curve(NO_SEEDS).tolist()} <= truth
    assert hits > 0 or variant == "printed"


@pytest.mark.parametrize("variant", VARIANTS)
def test_on_tiny_meshes_an_exhaustive_budget_finds_everything(variant):
    """Two cubes in twelve poses; the search goes on after each hit until none is left."""
    box = box_mesh()
    rng = np.random.default_rng(2)
    search = search_of(box, box, variant=variant, budget=20_000, stop_first=False)
    for stamp, rotation in enumerate(random_rotations(rng, 12)):
        pose = rotation, rng.uniform(-0.9, 0.9, 3)
        truth = exact_pairs(search, box, box, pose, AT_ORIGIN)
        query, answer = search.search(pose, AT_ORIGIN, stamp), set()
        while query.hit is not None:
            assert query.hit not in answer, "a pair is found once"
            answer.add(query.hit)
            query = search.search_further()
        assert answer == truth


@pytest.mark.sampled(2)
@pytest.mark.parametrize("variant", VARIANTS)
def test_equal_seeds_give_equal_queries_in_any_thread(variant):
    """Eight poses at seconds 0 to 7, asked in order, in four threads, and backwards."""
    ball = ball_of(faces=800)
    poses = colliding_poses(ball, ball, count=8, seed=7)

    def query_at(stamp):
        return search_of(ball, ball, variant=variant, budget=4000).search(poses[stamp], AT_ORIGIN, stamp)

    alone = [query_at(stamp) for stamp in range(8)]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(query_at, range(8))) == alone
    again = search_of(ball, ball, variant=variant, budget=4000)
    assert [again.search(poses[stamp], AT_ORIGIN, stamp) for stamp in reversed(range(8))] == alone[::-1]


@pytest.mark.parametrize("variant", VARIANTS)
def test_degenerate_and_smallest_input_is_searched_all_the_same(variant):
    """A face that is a point, upon itself and 1e-300 m above itself."""
    point = TriangleMesh([[0, 0, 0]], [[0, 0, 0]])
    search = search_of(point, point, variant=variant, budget=10)
    assert search.search(AT_ORIGIN, AT_ORIGIN, stamp=0.0).hit == (0, 0)
    assert search.search((I3, np.array([0, 0, 1e-300])), AT_ORIGIN, stamp=0.0).hit is None


@pytest.mark.parametrize("scale", [2.0**-600, 2.0**400])
def test_sizes_beyond_the_compiled_predicate_are_decided_by_integers(scale):
    """Unit boxes 0.75 m apart on X overlap and 1.5 m apart do not, whatever power of two scales them."""
    box = TriangleMesh(box_mesh().vertices * scale, box_mesh().faces)
    search = search_of(box, box, variant="local", budget=2000)
    pose = (I3, np.array([0.75, 0.5, 0.25]) * scale)
    query = search.search(pose, AT_ORIGIN, stamp=0.0)
    assert query.hit in exact_pairs(search, box, box, pose, AT_ORIGIN)
    assert search.search((I3, np.array([1.5, 0, 0]) * scale), AT_ORIGIN, stamp=0.0).hit is None


@pytest.mark.parametrize("variant", ["memetic", "corrected", "local", "random"])
def test_start_at_a_meeting_pair_hits_immediately(variant):
    """One evaluation finds the pair at which the search starts."""
    ball = ball_of(faces=800)
    search = search_of(ball, ball, variant=variant, budget=100_000)
    pose = (I3, np.array([1.5, 0.1, 0.2]))
    assert len(intersecting_faces(ball, ball, np.block([[I3, pose[1][:, None]], [np.zeros((1, 3)), 1]])))
    start = min(exact_pairs(search, ball, ball, pose, AT_ORIGIN))
    query = search.search(pose, AT_ORIGIN, stamp=0.0, start=start)
    assert (query.hit, query.evaluations) == (start, 1)
    assert (int(search.state["start_a"]), int(search.state["start_b"])) == start


@pytest.mark.parametrize(("local", "world"), [(0.0, 0.0), (1e3, 0.0), (0.0, 1e6), (1e3, 1e3)])
def test_touching_faces_are_never_skipped_wherever_they_lie(local, world):
    """Two thin triangles share one corner, where the balls round them are tangent: one evaluation must find the touch.

    ``local``: metres from the bodies' origin to that corner, ``world``: from the world's origin to the bodies.
    """
    rng = np.random.default_rng(3)
    tip = np.array([local, 0.0, 0.0])
    away = np.array([[0, 0, 0], [0.5, 0.01, 0], [0.5, -0.01, 0]])
    meshes = [TriangleMesh(tip + side * away, [[0, 1, 2]]) for side in (1.0, -1.0)]
    search = search_of(*meshes, variant="random", budget=1)
    for rotation in random_rotations(rng, 200):
        # the same pose for both, so that the shared corner stays shared to the bit
        pose = rotation, rng.normal(size=3) * world
        assert search.search(pose, pose, stamp=0.0).hit == (0, 0)
