"""Buffers of Newton grow until they hold all contacts; a stand-in for the engine has the counters that are read."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from support.shapes import box_mesh

from cdcore import Body
from cdcore.engines import newton_world
from cdcore.engines.engine_solids import engine_solid
from cdcore.engines.newton_world import NewtonWorld
from cdcore.errors import InvalidMeshError


def counter(number):
    """A counter of Newton: an array of one number."""
    return SimpleNamespace(numpy=lambda: np.array([number]))


def engine_that_finds(contacts, triangles, dropped=(0, 0), room_of_reducer=0):
    """A stand-in for ``newton``: every query has so many contacts and pairs of triangles.

    ``dropped``: insertions and contacts that the reducer drops while there is room for fewer triangles than
    ``room_of_reducer``; ``None``: there is no reducer.
    """

    def pipeline(_model, rigid_contact_max, max_triangle_pairs, **_):
        drops = dropped if dropped is None or max_triangle_pairs < room_of_reducer else (0, 0)
        reducer = drops and SimpleNamespace(ht_insert_failures=counter(drops[0]), buffer_overflows=counter(drops[1]))
        shapes = [SimpleNamespace(numpy=lambda body=body: np.full(contacts, body)) for body in (0, 1)]
        listed = SimpleNamespace(
            rigid_contact_count=counter(contacts), rigid_contact_shape0=shapes[0], rigid_contact_shape1=shapes[1]
        )
        phase = SimpleNamespace(triangle_pairs_count=counter(triangles), global_contact_reducer=reducer)
        return SimpleNamespace(contacts=lambda: listed, collide=lambda *_: None, narrow_phase=phase)

    state = SimpleNamespace(body_q=SimpleNamespace(assign=lambda poses: None))
    builder = SimpleNamespace(
        finalize=lambda device: SimpleNamespace(state=lambda: state),
        add_body=lambda: 0,
        add_shape_convex_hull=lambda *_, **__: None,
    )

    class ModelBuilder:
        ShapeConfig = SimpleNamespace

        def __new__(cls, gravity):
            return builder

    return SimpleNamespace(ModelBuilder=ModelBuilder, CollisionPipeline=pipeline, Mesh=lambda *_, **__: None)


WARP = SimpleNamespace(
    config=SimpleNamespace(log_level=0), LOG_ERROR=1, init=lambda: None, vec2i=None, array=lambda pairs, **_: pairs,
    _src=SimpleNamespace(build=SimpleNamespace(build_cpu=None)),
)  # fmt: skip


def world_of(monkeypatch, engine):
    """A world of two cubes, whose buffers begin with room for four contacts and for four pairs of triangles."""
    monkeypatch.setitem(sys.modules, "newton", engine)
    monkeypatch.setitem(sys.modules, "warp", WARP)
    for name, room in {"LEAST_ROOM": 4, "CONTACTS_PER_PAIR": 0, "TRIANGLE_PAIRS": 4, "LARGEST_ROOM": 64}.items():
        monkeypatch.setattr(newton_world, name, room)
    cubes = [engine_solid(Body(name, box_mesh()), shape="hull", engine="it", least_thickness=1e-4) for name in "ab"]
    return NewtonWorld(cubes, np.array([[0, 1]]), SimpleNamespace(gap_m=0.0))


@pytest.mark.parametrize(
    ("contacts", "triangles", "contact_room", "triangle_room"),
    [
        pytest.param(3, 4, 4, 4, id="all fits"),
        pytest.param(4, 0, 8, 4, id="a full list of contacts, which may have lost some: twice the room"),
        pytest.param(
            11, 0, 22, 4, id="more contacts than twice the room: room for all would be full, so twice as much"
        ),
        pytest.param(0, 5, 4, 8, id="more pairs of triangles than room: twice the room"),
        pytest.param(0, 64, 4, 64, id="as many pairs of triangles as there may be"),
    ],
)
def test_buffers_grow_until_nothing_is_dropped(monkeypatch, contacts, triangles, contact_room, triangle_room):
    """A stand-in for the engine Newton: room begins at 4 contacts and 4 pairs of triangles, and may grow to 64.

    Every query has so many of each.
    """
    world = world_of(monkeypatch, engine_that_finds(contacts, triangles))
    assert (world.contact_room, world.triangle_room) == (contact_room, triangle_room)


@pytest.mark.parametrize("dropped", [(1, 0), (0, 1), (1, 1)], ids=["an insertion fails", "a contact overflows", "both"])
def test_triangle_buffer_grows_while_the_reducer_drops_contacts(monkeypatch, dropped):
    """Newton's reducer of contacts drops some while there is room for fewer than 8 pairs of triangles;
    it begins at 4.
    """
    engine = engine_that_finds(contacts=0, triangles=0, dropped=dropped, room_of_reducer=8)
    assert world_of(monkeypatch, engine).triangle_room == 8


def test_engine_without_a_reducer_keeps_its_buffers(monkeypatch):
    """Nothing can have been dropped: room stays at 4."""
    world = world_of(monkeypatch, engine_that_finds(contacts=0, triangles=0, dropped=None))
    assert (world.contact_room, world.triangle_room) == (4, 4)


@pytest.mark.parametrize(("contacts", "triangles"), [(65, 0), (0, 65)], ids=["contacts", "pairs of triangles"])
def test_buffers_beyond_the_largest_are_refused(monkeypatch, contacts, triangles):
    """The largest room is 64, and a frame has 65."""
    with pytest.raises(InvalidMeshError, match="more than 64 in one frame"):
        world_of(monkeypatch, engine_that_finds(contacts, triangles))
