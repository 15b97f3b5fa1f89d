"""USD beside the library's own values: poses, colliders, filtered pairs, motion; and what cannot be taken."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sessions.errors import SceneSourceError, SessionError
from sessions.importers import import_session
from sessions.scene_formats.scene_source import Surface, read_scene_source

pxr = pytest.importorskip("pxr")

from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, Vt  # noqa: E402

CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.1, 0.1, 0.1)]
"""Corners of a tetrahedron with legs of 1 along the axes, and a point inside it."""
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 4), (2, 3, 4), (3, 1, 4)]
"""Its slanted side is dented to the point inside: a hollow that the convex hull fills."""
UNIT = 0.01
"""Metres per unit of most stages here: centimetres."""


@pytest.fixture(autouse=True)
def without_trial(monkeypatch):
    """Binary layers are read at once: none of these files ends the library, and another process takes 0.4 s."""
    monkeypatch.setattr("sessions.scene_formats.usd_layers.try_scene", lambda path, root: None)


def new_stage(path, *, up="Z", unit=UNIT):
    """An empty stage, a file of USD, with this axis up and so many metres per unit."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    return stage


def rigid_body(stage, path, *, translation=(0, 0, 0), angles=(0, 0, 0), scale=1.0):
    """Adds a rigid body to a stage."""
    prim = UsdGeom.Xform.Define(stage, path)
    prim.AddTranslateOp().Set(Gf.Vec3d(*translation))
    prim.AddRotateXYZOp().Set(Gf.Vec3f(*angles))
    prim.AddScaleOp().Set(Gf.Vec3f(scale))
    UsdPhysics.RigidBodyAPI.Apply(prim.GetPrim())
    return prim


def collider(prim, *, translation=(0, 0, 0), angles=(0, 0, 0), scale=(1, 1, 1), approximation=""):
    """Makes a prim a collider, moved, rotated and scaled."""
    prim.AddTranslateOp().Set(Gf.Vec3d(*translation))
    prim.AddRotateXYZOp().Set(Gf.Vec3f(*angles))
    prim.AddScaleOp().Set(Gf.Vec3f(*scale))
    UsdPhysics.CollisionAPI.Apply(prim.GetPrim())
    if approximation:
        UsdPhysics.MeshCollisionAPI.Apply(prim.GetPrim()).GetApproximationAttr().Set(approximation)
    return prim


def stage_mesh(stage, path, *, corners=CORNERS, faces=FACES):
    """Adds a mesh to a stage."""
    prim = UsdGeom.Mesh.Define(stage, path)
    prim.GetPointsAttr().Set(Vt.Vec3fArray([Gf.Vec3f(*corner) for corner in corners]))
    prim.GetFaceVertexCountsAttr().Set([len(face) for face in faces])
    prim.GetFaceVertexIndicesAttr().Set([index for face in faces for index in face])
    return prim


def ball_collider(stage, path, **more):
    """Adds a sphere that collides to a stage."""
    return collider(UsdGeom.Sphere.Define(stage, path), **more)


def in_world(stage, path, points):
    """Points of a prim where the library has them, metres, in the axes of the stage."""
    pose = UsdGeom.XformCache().GetLocalToWorldTransform(stage.GetPrimAtPath(path))
    return np.array([pose.Transform(Gf.Vec3d(*map(float, point))) for point in points]) * UNIT


def corners_in_world(source_body, mesh_data):
    """Corners of a mesh where its body stands."""
    return mesh_data.vertices @ source_body.pose[:3, :3].T + source_body.pose[:3, 3]


@pytest.fixture(scope="module")
def bench_file(tmp_path_factory):
    """A cup of two colliders, turned and scaled by 2, on a table, and a rack of five round shapes, in centimetres.

    All are turned by 20 degrees about z. The collider "handle" of the cup is mirrored along x.
    """
    path = tmp_path_factory.mktemp("bench") / "bench.usda"
    stage = new_stage(path)
    UsdGeom.Xform.Define(stage, "/World").AddRotateZOp().Set(20.0)
    cup = rigid_body(stage, "/World/cup", translation=(10, 20, 30), angles=(10, 20, 30), scale=2.0)
    UsdPhysics.MassAPI.Apply(cup.GetPrim()).GetMassAttr().Set(0.25)
    collider(stage_mesh(stage, "/World/cup/wall"), translation=(1, 2, 3), angles=(4, 5, 6), approximation="convexHull")
    collider(stage_mesh(stage, "/World/cup/inner/handle"), translation=(3, 2, 1), scale=(-1, 2, 3))
    collider(UsdGeom.Cube.Define(stage, "/World/table"), translation=(0, 0, -5), scale=(50, 30, 1))
    rack = "/World/rack"
    rigid_body(stage, rack, angles=(0, 0, 40))
    for number, (kind, axis) in enumerate(
        [("Sphere", ""), ("Capsule", "X"), ("Cylinder", "Y"), ("Cone", "Z"), ("Capsule", "Z")]
    ):
        prim = getattr(UsdGeom, kind).Define(stage, f"{rack}/{kind}_{axis or number}")
        prim.GetRadiusAttr().Set(3.0)
        if axis:
            prim.GetAxisAttr().Set(axis)
            prim.GetHeightAttr().Set(8.0)
        collider(
            prim, translation=(0, 20 * number, 0), angles=(0, 0, 30), scale=(1, 2, 3) if number == 0 else (2, 1, 1.5)
        )
    stage.Save()
    return path


@pytest.fixture(scope="module")
def bench(bench_file):
    """The scene of the bench's file."""
    return read_scene_source(bench_file)


@pytest.fixture(scope="module")
def bench_stage(bench_file):
    """The bench's file as USD's own library reads it."""
    return Usd.Stage.Open(str(bench_file))


def test_usd_bodies_have_kind_mass_and_unit(bench):
    """Cup (of 0.25 kg) and rack are rigid bodies and move, the table only collides and has no mass.

    The stage is in centimetres, which is noted.
    """
    assert bench.format == "USD"
    assert {name: body.moves for name, body in bench.bodies.items()} == {"cup": True, "table": False, "rack": True}
    assert bench.bodies["cup"].mass == 0.25 and bench.bodies["table"].mass is None
    assert bench.notes == ("lengths times 0.01 (metersPerUnit)",)


@pytest.mark.parametrize("name", ["cup", "rack"])
def test_usd_body_poses_agree_with_pxr(bench, bench_stage, name):
    """A body has the rotation and position of its prim by USD's own library, without scale, to 1e-9 m (UNIT: 1 cm)."""
    pose, prim = bench.bodies[name].pose, bench_stage.GetPrimAtPath(f"/World/{name}")
    expected = UsdGeom.XformCache().GetLocalToWorldTransform(prim).RemoveScaleShear()
    assert np.abs(pose[:3, :3] - np.array(expected.ExtractRotationMatrix()).T).max() <= 1e-9
    assert np.abs(pose[:3, 3] - UNIT * np.array(expected.ExtractTranslation())).max() <= 1e-9


def test_usd_colliders_stand_where_pxr_has_them(bench, bench_stage):
    """Corners of the cup's mesh colliders in the world, to 1e-9 m.

    The wall is the hull of its mesh, of the four outer corners; the handle is mirrored, which turns no face inside out.
    """
    cup = bench.bodies["cup"]
    wall, handle = cup.colliders
    corners = np.array(CORNERS, dtype=np.float32)
    outer_corners = corners[:4]
    expected_wall = in_world(bench_stage, "/World/cup/wall", outer_corners)
    expected_handle = in_world(bench_stage, "/World/cup/inner/handle", corners)
    assert np.abs(corners_in_world(cup, wall) - expected_wall).max() <= 1e-9
    assert np.abs(corners_in_world(cup, handle) - expected_handle).max() <= 1e-9
    assert wall.volume > 0.0 and handle.volume > 0.0


def shapes_of_the_library(stage):
    """Type of shape -> name of a prim -> its size in the units of the stage, as USD's own parser reads it."""
    load = getattr(UsdPhysics, "UsdPhysicsLoadStageFromPrimRange", None) or UsdPhysics.LoadUsdPhysicsFromRange
    parsed = load(stage, ["/"])
    return {
        kind: {path.name: size for path, size in zip(*parsed[getattr(UsdPhysics.ObjectType, kind)], strict=True)}
        for kind in ("SphereShape", "CapsuleShape", "CylinderShape", "ConeShape", "CubeShape")
    }


@pytest.mark.parametrize("name", ["Sphere_0", "Capsule_X", "Cylinder_Y", "Cone_Z", "Capsule_Z"])
def test_round_colliders_have_the_sizes_of_the_library(bench, bench_stage, name):
    """Each vertex lies on the round shape, of the radius and half height that USD's own parser reads, to 1e-9 m.

    The letter of a name is the axis of the shape; a cone has its tip at the upper end.
    """
    size = shapes_of_the_library(bench_stage)[f"{name[:-2]}Shape"][name]
    rack = bench.bodies["rack"]
    names = [prim.GetName() for prim in bench_stage.GetPrimAtPath("/World/rack").GetChildren()]
    vertices = corners_in_world(rack, rack.colliders[names.index(name)])
    prim = bench_stage.GetPrimAtPath(f"/World/rack/{name}")
    rigid = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim).RemoveScaleShear())
    local = (vertices - UNIT * rigid[3, :3]) @ rigid[:3, :3].T

    radius = UNIT * size.radius
    if name.startswith("Sphere"):
        assert np.abs(np.linalg.norm(local, axis=1) - radius).max() <= 1e-9
        return
    half_height, axis = UNIT * size.halfHeight, "XYZ".index(name[-1])
    axial, from_axis = local[:, axis], np.linalg.norm(np.delete(local, axis, axis=1), axis=1)
    if name.startswith("Capsule"):
        beyond_segment = axial - np.clip(axial, -half_height, half_height)
        assert np.abs(np.hypot(from_axis, beyond_segment) - radius).max() <= 1e-9
        return
    upper_radius = 0.0 if name.startswith("Cone") else radius
    assert np.abs(np.abs(axial) - half_height).max() <= 1e-9
    assert abs(from_axis[axial < 0].max() - radius) <= 1e-9
    assert abs(from_axis[axial > 0].max() - upper_radius) <= 1e-9


def test_cube_collider_has_the_size_of_the_library(bench, bench_stage):
    """The edges of the bench's table are twice the half extents that USD's own parser reads, to 1e-9 m."""
    table = bench.bodies["table"]
    size = shapes_of_the_library(bench_stage)["CubeShape"]["table"]
    edges = 2 * UNIT * np.array(size.halfExtents, dtype=np.float64)
    assert np.abs(np.ptp(table.mesh.vertices, axis=0) - edges).max() <= 1e-9


def cup_with_approximation(folder, approximation):
    """A scene in metres with a cup whose mesh of five corners, one of them inside, collides by this approximation."""
    stage = new_stage(folder / "s.usda", unit=1.0)
    rigid_body(stage, "/cup", translation=(1, 2, 3))
    collider(stage_mesh(stage, "/cup/wall"), approximation=approximation)
    stage.Save()
    return read_scene_source(folder / "s.usda")


@pytest.mark.parametrize(
    ("approximation", "corners", "sentence"),
    [
        pytest.param("none", 5, "", id="the mesh itself"),
        pytest.param("convexHull", 4, "", id="its hull"),
        pytest.param("convexDecomposition", 5, "an engine cuts itself", id="pieces: the mesh instead"),
        pytest.param("meshSimplification", 5, "an engine makes itself", id="a simpler mesh: the mesh instead"),
        pytest.param("boundingCube", 8, "an engine may rotate", id="a box about it"),
    ],
)
def test_mesh_collides_as_its_file_says(tmp_path, approximation, corners, sentence):
    """A cup's mesh has five corners, one of them inside, and collides by ``approximation``: as a solid of ``corners``.

    ``sentence``: how the solid differs from an engine's, where it may.
    """
    scene = cup_with_approximation(tmp_path, approximation)
    (solid,) = scene.bodies["cup"].colliders
    assert len(solid.vertices) == corners
    assert bool(scene.left_out) == bool(sentence)
    assert sentence in " ".join(scene.left_out)


def test_bounding_sphere_of_a_mesh_is_that_of_its_box(tmp_path):
    """The mesh fills a box of 1 m from the origin: the ball about it has its middle at 0.5 m and half a diagonal."""
    scene = cup_with_approximation(tmp_path, "boundingSphere")
    (ball,) = scene.bodies["cup"].colliders
    half_diagonal = np.sqrt(3.0) / 2
    assert np.abs(np.linalg.norm(ball.vertices - 0.5, axis=1) - half_diagonal).max() <= 1e-6
    assert "an engine may shrink" in " ".join(scene.left_out)


@pytest.mark.parametrize("approximation", ["sdf", "sphereFill"])
def test_mesh_that_collides_in_an_unknown_way_is_listed(tmp_path, approximation):
    """A cup's mesh of five corners collides as a distance field or as many balls: it has no collider, as is listed."""
    scene = cup_with_approximation(tmp_path, approximation)
    assert scene.bodies["cup"].colliders == () and len(scene.bodies["cup"].mesh.vertices) == 5
    assert f"its mesh collides as '{approximation}'" in " ".join(scene.left_out)


def stage_with_balls(path, *names):
    """A stage with a rigid body /world/NAME for each name, 10 apart, each with a ball, /world/NAME/shape."""
    stage = new_stage(path)
    for number, name in enumerate(names):
        rigid_body(stage, f"/world/{name}", translation=(number * 10, 0, 0))
        ball_collider(stage, f"/world/{name}/shape")
    return stage


def define_joint(stage, first, second):
    """A joint of two prims of a stage."""
    joint = UsdPhysics.RevoluteJoint.Define(stage, "/world/wrist")
    joint.CreateBody0Rel().AddTarget(first)
    joint.CreateBody1Rel().AddTarget(second)
    return joint


@pytest.mark.parametrize(
    ("filtering", "filtered"),
    [
        pytest.param("/world/arm", "/world/hand", id="body"),
        pytest.param("/world/arm/shape", "/world/hand/shape", id="collider"),
    ],
)
def test_filtered_pairs_are_excluded(tmp_path, filtering, filtered):
    """There are arm, hand and cup; the arm or its only collider names the hand or its only collider."""
    stage = stage_with_balls(tmp_path / "s.usda", "arm", "hand", "cup")
    api = UsdPhysics.FilteredPairsAPI.Apply(stage.GetPrimAtPath(filtering))
    api.CreateFilteredPairsRel().AddTarget(filtered)
    stage.Save()
    assert read_scene_source(tmp_path / "s.usda").excluded == (("arm", "hand"),)


def test_groups_that_filter_each_other_are_an_excluded_pair(tmp_path):
    """Arm and hand are a collision group each, which filters out the other; the cup is of no group."""
    stage = stage_with_balls(tmp_path / "s.usda", "arm", "hand", "cup")
    for name, filtered in (("arm", "hand"), ("hand", "arm")):
        group = UsdPhysics.CollisionGroup.Define(stage, f"/groups/{name}")
        group.GetCollidersCollectionAPI().CreateIncludesRel().AddTarget(f"/world/{name}")
        group.CreateFilteredGroupsRel().AddTarget(f"/groups/{filtered}")
    stage.Save()
    assert read_scene_source(tmp_path / "s.usda").excluded == (("arm", "hand"),)


def test_bodies_of_a_joint_are_an_excluded_pair(tmp_path):
    """A joint holds the arm and the hand's collider; the joint itself is listed as not taken."""
    stage = stage_with_balls(tmp_path / "s.usda", "arm", "hand", "cup")
    define_joint(stage, "/world/arm", "/world/hand/shape")
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    assert scene.excluded == (("arm", "hand"),)
    assert "joints (1 PhysicsRevoluteJoint)" in " ".join(scene.left_out)


@pytest.mark.parametrize(
    ("collides", "is_enabled"),
    [pytest.param(True, True, id="lets its bodies collide"), pytest.param(False, False, id="is switched off")],
)
def test_joint_that_lets_bodies_collide_excludes_no_pair(tmp_path, collides, is_enabled):
    """A joint of arm and hand enables their collision, or is no joint at present."""
    stage = stage_with_balls(tmp_path / "s.usda", "arm", "hand")
    joint = define_joint(stage, "/world/arm", "/world/hand")
    joint.CreateCollisionEnabledAttr(collides)
    joint.CreateJointEnabledAttr(is_enabled)
    stage.Save()
    assert read_scene_source(tmp_path / "s.usda").excluded == ()


@pytest.mark.parametrize(("first", "second"), [("arm", "arm"), ("arm", ""), ("arm", "empty")])
def test_joint_of_fewer_than_two_colliding_bodies_excludes_no_pair(tmp_path, first, second):
    """A joint within one body, one of a body with the world, and one with a body that has no shape."""
    stage = new_stage(tmp_path / "s.usda")
    for number, name in enumerate(("arm", "hand", "empty")):
        rigid_body(stage, f"/world/{name}", translation=(number * 10, 0, 0))
        if name != "empty":
            ball_collider(stage, f"/world/{name}/shape")
    joint = UsdPhysics.RevoluteJoint.Define(stage, "/world/wrist")
    joint.CreateBody0Rel().AddTarget(f"/world/{first}")
    if second:
        joint.CreateBody1Rel().AddTarget(f"/world/{second}")
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    assert scene.excluded == () and [*scene.bodies] == ["arm", "hand"]


@pytest.mark.parametrize(
    ("self_collisions", "excluded"),
    [(False, (("arm", "hand"), ("arm", "cup"), ("hand", "cup"))), (True, ())],
)
def test_articulation_excludes_all_its_pairs_unless_they_collide(tmp_path, self_collisions, excluded):
    """Arm, hand and cup are of one articulation of PhysX, whose bodies may collide with each other or not."""
    stage = stage_with_balls(tmp_path / "s.usda", "arm", "hand", "cup")
    attribute = "physxArticulation:enabledSelfCollisions"
    stage.GetPrimAtPath("/world").CreateAttribute(attribute, Sdf.ValueTypeNames.Bool).Set(self_collisions)
    stage.Save()
    assert read_scene_source(tmp_path / "s.usda").excluded == excluded


def test_usd_filter_of_single_colliders_is_listed_as_unsupported(tmp_path):
    """Arm and cup have two colliders each, and one of the arm's filters the cup: the others still meet.

    So the pair of bodies is not excluded, and the filter is listed as not taken.
    """
    stage = new_stage(tmp_path / "s.usda")
    for name in ("arm", "cup"):
        rigid_body(stage, f"/{name}")
        for child in ("a", "b"):
            ball_collider(stage, f"/{name}/{child}")
    api = UsdPhysics.FilteredPairsAPI.Apply(stage.GetPrimAtPath("/arm/a"))
    api.CreateFilteredPairsRel().AddTarget("/cup")
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    assert scene.excluded == ()
    assert "some colliders of 'arm' and 'cup' meet" in " ".join(scene.left_out)


def test_offsets_become_margins(tmp_path):
    """PhysX's contact offset of 2 cm, a gap that counts as contact, is a margin of 0.02 m; -inf, its default, is none.

    A rest offset, by which bodies stay apart, is listed as not taken.
    """
    stage = new_stage(tmp_path / "s.usda")
    for name, contact_offset, rest_offset in (("cup", 2.0, 0.0), ("tray", float("-inf"), 1.0)):
        rigid_body(stage, f"/{name}")
        prim = ball_collider(stage, f"/{name}/shape").GetPrim()
        prim.CreateAttribute("physxCollision:contactOffset", Sdf.ValueTypeNames.Float).Set(contact_offset)
        prim.CreateAttribute("physxCollision:restOffset", Sdf.ValueTypeNames.Float).Set(rest_offset)
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    assert {name: body.margin for name, body in scene.bodies.items()} == {"cup": 0.02, "tray": 0.0}
    assert scene.left_out == ("the rest offset of 'tray'",)


def test_drawn_surface_and_hidden_colliders_are_distinguished(tmp_path):
    """A cup is drawn as a mesh of 5 vertices, and a hidden cube of 8 collides in its place.

    Its surface is the drawn one, unless a caller takes the colliding one.
    """
    stage = new_stage(tmp_path / "s.usda", unit=1.0)
    rigid_body(stage, "/cup")
    stage_mesh(stage, "/cup/drawn")
    hidden = collider(UsdGeom.Cube.Define(stage, "/cup/solid"), translation=(0.5, 0.5, 0.5), scale=(0.5, 0.5, 0.5))
    hidden.GetPurposeAttr().Set("guide")
    stage.Save()
    cup = read_scene_source(tmp_path / "s.usda").bodies["cup"]
    assert cup.surface == "drawn" and len(cup.mesh.vertices) == 5
    assert [len(solid.vertices) for solid in cup.colliders] == [8]
    colliding_cup = read_scene_source(tmp_path / "s.usda", surface=Surface.COLLIDING).bodies["cup"]
    assert len(colliding_cup.mesh.vertices) == 8


def test_instances_and_referenced_layers_are_bodies_of_their_own(tmp_path):
    """Left and right, 1 and 2 m along x, have a prim "cup" each: instances of one binary file.

    Both are bodies, and as their names are the same, each has its parent's name before it, which is noted.
    """
    inner_stage = new_stage(tmp_path / "part.usdc", unit=1.0)
    rigid_body(inner_stage, "/part", scale=1.0)
    collider(stage_mesh(inner_stage, "/part/wall"))
    inner_stage.SetDefaultPrim(inner_stage.GetPrimAtPath("/part"))
    inner_stage.Save()
    stage = new_stage(tmp_path / "s.usda", unit=1.0)
    for name, x in (("left", 1), ("right", 2)):
        prim = UsdGeom.Xform.Define(stage, f"/{name}")
        prim.AddTranslateOp().Set(Gf.Vec3d(x, 0, 0))
        inner = stage.DefinePrim(f"/{name}/cup")
        inner.GetReferences().AddReference("./part.usdc")
        inner.SetInstanceable(True)
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    assert {name: body.pose[0, 3] for name, body in scene.bodies.items()} == {"left/cup": 1.0, "right/cup": 2.0}
    assert scene.notes == ("names that are there more than once: 'left/cup' for 'cup', 'right/cup' for 'cup'",)


Z_UP_TO_Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""The rotation from the axes of a stage with +Z up to those of a session, in which +Y is up."""


@pytest.mark.parametrize(
    ("up", "world", "ending"),
    [("Y", np.eye(3), "usda"), ("Z", Z_UP_TO_Y_UP, "usdc"), ("Z", Z_UP_TO_Y_UP, "usd")],
    ids=["Y up, text", "Z up, binary", "Z up, either"],
)
def test_time_samples_become_poses(tmp_path, up, world, ending):
    """50 time codes a second from code 10 on: 20 ms a code; positions in centimetres.

    The cup has samples at codes 10, 11 and 13, its carrier at 10 and 14: the cup has a pose at each of the four, where
    USD itself places it. The tray has no samples and is fixed; that the axes were changed is said.
    """
    path = tmp_path / f"motion.{ending}"
    stage = new_stage(path, up=up)
    stage.SetTimeCodesPerSecond(50)
    carrier_translation = UsdGeom.Xform.Define(stage, "/carrier").AddTranslateOp()
    for code in (10, 14):
        carrier_translation.Set(Gf.Vec3d(code, 2 * code, 0), code)
    _, cup_rotation, _ = rigid_body(stage, "/carrier/cup", scale=2.0).GetOrderedXformOps()
    for code in (10, 11, 13):
        cup_rotation.Set(Gf.Vec3f(code, 2 * code, 3 * code), code)
    ball_collider(stage, "/carrier/cup/shape")
    rigid_body(stage, "/tray")
    ball_collider(stage, "/tray/shape")
    stage.Save()

    session = import_session("auto", path)
    assert [*session.tracks] == ["cup"]
    track = session.tracks["cup"]
    assert track.times_ns.tolist() == [(code - 10) * 20_000_000 for code in (10, 11, 13, 14)]
    for row, code in enumerate((10, 11, 13, 14)):
        pose = UsdGeom.XformCache(code).GetLocalToWorldTransform(stage.GetPrimAtPath("/carrier/cup")).RemoveScaleShear()
        rotation = world @ np.array(pose.ExtractRotationMatrix()).T
        assert np.abs(Rotation.from_quat(track.quaternions_xyzw[row]).as_matrix() - rotation).max() <= 1e-9, row
        assert np.abs(track.positions[row] - world @ pose.ExtractTranslation() * UNIT).max() <= 1e-9, row
    assert session.scene.body("tray").fixed is not None and session.scene.body("cup").fixed is None
    assert ("world +Z up" in session.facts["conversions"]) == (up == "Z")


RACK = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
"""The outline of a U, whose arms a fan of the first corner would join."""


def test_concave_faces_are_cut_inside_their_outline(tmp_path):
    """A rack in the form of a U: an area of 7 units, an outline of 16 units, and 1 unit deep, of two faces and 8 sides.

    Triangles inside the outline alone have its area, 2 * 7 + 16 * 1, and its volume, 7 * 1.
    """
    stage = new_stage(tmp_path / "rack.usda")
    count = len(RACK)
    sides = [(at, (at + 1) % count, count + (at + 1) % count, count + at) for at in range(count)]
    faces = [tuple(reversed(range(count))), tuple(range(count, 2 * count)), *sides]
    rigid_body(stage, "/rack")
    collider(stage_mesh(stage, "/rack/u", corners=[(x, y, z) for z in (0, 1) for x, y in RACK], faces=faces))
    stage.Save()
    rack = read_scene_source(tmp_path / "rack.usda").bodies["rack"].mesh
    first, second, third = (rack.triangles[:, corner] for corner in range(3))
    area = np.linalg.norm(np.cross(second - first, third - first), axis=1).sum() / 2.0
    assert area == pytest.approx((2 * 7 + 16) * UNIT**2, rel=1e-6)
    assert rack.volume == pytest.approx(7 * UNIT**3, rel=1e-6)


def test_holes_of_a_usd_mesh_are_no_faces(tmp_path):
    """A mesh of six faces lists 1 and 4 as holes, which are left out; 6 and -1, numbers of no face, are passed over."""
    stage = new_stage(tmp_path / "shell.usda")
    rigid_body(stage, "/shell")
    shell = collider(stage_mesh(stage, "/shell/mesh"))
    shell.GetHoleIndicesAttr().Set([1, 4, len(FACES), -1])
    stage.Save()
    faces = read_scene_source(tmp_path / "shell.usda").bodies["shell"].mesh.faces
    assert faces.tolist() == [[*face] for number, face in enumerate(FACES) if number not in (1, 4)]


@pytest.mark.parametrize(
    ("codes_per_second", "frames_per_second"),
    [pytest.param(60, 60, id="a frame a time code"), pytest.param(1000, 25, id="a frame in 40 time codes")],
)
def test_bodies_are_posed_between_their_time_samples(tmp_path, codes_per_second, frames_per_second):
    """The rod has samples at 0 and 2 s, the cup at 1 s too: both have a pose in every frame, where USD places them."""
    stage = new_stage(tmp_path / "keys.usda", up="Y", unit=1.0)
    stage.SetTimeCodesPerSecond(codes_per_second)
    stage.SetFramesPerSecond(frames_per_second)
    for name, seconds in (("rod", (0, 2)), ("cup", (0, 1, 2))):
        translation, rotation, _ = rigid_body(stage, f"/{name}").GetOrderedXformOps()
        for second in seconds:
            translation.Set(Gf.Vec3d(second, second**2, 0), second * codes_per_second)
            rotation.Set(Gf.Vec3f(0, 0, 90 * second), second * codes_per_second)
        ball_collider(stage, f"/{name}/shape")
    stage.Save()
    session = import_session("usd", tmp_path / "keys.usda")
    assert session.tracks.keys() == {"rod", "cup"}
    for name, track in session.tracks.items():
        assert len(track.times_ns) == 2 * frames_per_second + 1 and track.valid.all(), name
        for row, nanoseconds in enumerate(track.times_ns.tolist()):
            cache = UsdGeom.XformCache(nanoseconds / 1e9 * codes_per_second)
            expected = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(f"/{name}"))
            assert np.abs(track.positions[row] - expected.ExtractTranslation()).max() <= 1e-6, (name, row)
            rotation = Rotation.from_quat(track.quaternions_xyzw[row]).as_matrix()
            assert np.abs(rotation - np.array(expected.ExtractRotationMatrix()).T).max() <= 1e-6, (name, row)
    assert "as USD interpolates" in session.facts["conversions"]


def test_poses_of_a_usd_scene_are_limited(tmp_path, monkeypatch):
    """A body with 3 time samples has 3 poses: as many as a limit of 3 allows, and more than one of 2."""
    stage = new_stage(tmp_path / "long.usda")
    translation, _, _ = rigid_body(stage, "/cup").GetOrderedXformOps()
    for code in (0, 1, 2):
        translation.Set(Gf.Vec3d(code, 0, 0), code)
    ball_collider(stage, "/cup/shape")
    stage.Save()
    monkeypatch.setattr("sessions.scene_formats.usd_physics.MOST_POSES", 3)
    assert len(import_session("usd", tmp_path / "long.usda").frames) == 3
    monkeypatch.setattr("sessions.scene_formats.usd_physics.MOST_POSES", 2)
    with pytest.raises(SessionError, match="more than 2 poses; shorten it"):
        import_session("usd", tmp_path / "long.usda")


def test_unsupported_usd_subdivision_is_listed(tmp_path):
    """A cup has two meshes as colliders, one to be subdivided: its polygons are taken as they are, as is listed."""
    stage = new_stage(tmp_path / "smooth.usda")
    rigid_body(stage, "/cup")
    for name, scheme in (("smooth", "catmullClark"), ("plain", "none")):
        collider(stage_mesh(stage, f"/cup/{name}")).GetSubdivisionSchemeAttr().Set(scheme)
    stage.Save()
    assert read_scene_source(tmp_path / "smooth.usda").left_out == (
        "the subdivision of '/cup/smooth': its polygons are taken as they are",
    )


def test_usd_without_time_samples_is_refused_as_a_recording(tmp_path):
    """A ball has no values over time: the file is a scene for a recording, as the error says, and no recording."""
    stage_with_balls(tmp_path / "s.usda", "arm").Save()
    with pytest.raises(SessionError, match="time samples; take the scene"):
        import_session("usd", tmp_path / "s.usda")


def test_moving_usd_body_without_a_readable_mesh_names_the_cause(tmp_path):
    """A cup moves; a face of its mesh names corner 99, which does not exist, so that nothing is left to import."""
    stage = new_stage(tmp_path / "s.usda")
    translation, _, _ = rigid_body(stage, "/cup").GetOrderedXformOps()
    for code in (1, 2):
        translation.Set((code, 0, 0), code)
    collider(stage_mesh(stage, "/cup/m")).GetFaceVertexIndicesAttr().Set([0, 1, 99])
    stage.Save()
    with pytest.raises(SessionError, match=r"not taken: the collider '/cup/m': .*; take the scene"):
        import_session("usd", tmp_path / "s.usda")


def test_unsupported_usd_physics_is_listed_prim_by_prim(tmp_path):
    """The cup's scale, the radius of its shape and the place of its lid change over time; one of its meshes is broken.

    Beside it are a plane, a soft body and a trigger of PhysX, instances of points, a group that collides without a
    shape, and a body that is only drawn. Each is listed as not taken.
    """
    stage = new_stage(tmp_path / "s.usda")
    _, _, scale = rigid_body(stage, "/cup").GetOrderedXformOps()
    radius = ball_collider(stage, "/cup/shape").GetRadiusAttr()
    for code in (1, 2):
        scale.Set(Gf.Vec3f(code), code)
        radius.Set(1.0 + code, code)
    lid_translation, _, _ = ball_collider(stage, "/cup/lid").GetOrderedXformOps()
    lid_translation.Set(Gf.Vec3d(1, 2, 3), 3)
    collider(stage_mesh(stage, "/cup/broken", faces=[(0, 1, 9)]))
    collider(UsdGeom.Plane.Define(stage, "/ground"))
    stage_mesh(stage, "/cloth").GetPrim().AddAppliedSchema("PhysxDeformableSurfaceAPI")
    ball_collider(stage, "/zone").GetPrim().AddAppliedSchema("PhysxTriggerAPI")
    UsdGeom.PointInstancer.Define(stage, "/grass")
    UsdPhysics.CollisionAPI.Apply(UsdGeom.Xform.Define(stage, "/group").GetPrim())
    rigid_body(stage, "/ghost")
    stage_mesh(stage, "/ghost/drawn")
    stage.Save()
    listed = import_session("usd", tmp_path / "s.usda").facts["conversions"].replace("; ", " ")
    for sentence in (
        "the scale of 'cup', which changes",
        "the changing shape of '/cup/shape'",
        "the motion of '/cup/lid' within 'cup'",
        "the collider '/cup/broken': face 0 names vertex",
        "the collider '/ground': an endless plane",
        "the soft body '/cloth'",
        "the trigger '/zone'",
        "the instances of point instancer '/grass'",
        "the collider '/group': a shape 'Xform'",
        "the body 'ghost', of which nothing collides",
    ):
        assert sentence in listed


@pytest.mark.parametrize(
    "counts",
    [
        pytest.param([4, 3, 3, 3], id="one more"),
        pytest.param([3, 3, 3], id="three less"),
        pytest.param([3, 3, 3, 3, 3, -3], id="a count below 0"),
    ],
)
def test_mesh_of_contradicting_face_counts_is_listed(tmp_path, counts):
    """Four triangles have 12 indices of corners; ``counts``: corners of each face, as the file says.

    The last counts have a sum of 12 too and are no counts of corners.
    """
    stage = new_stage(tmp_path / "cup.usda")
    rigid_body(stage, "/cup")
    ball_collider(stage, "/cup/ball")
    tetrahedron = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
    collider(stage_mesh(stage, "/cup/torn", faces=tetrahedron)).GetFaceVertexCountsAttr().Set(counts)
    stage.Save()
    sentence = f"the collider '/cup/torn': its mesh has 12 indices, and its faces count {sum(counts)}"
    assert sentence in read_scene_source(tmp_path / "cup.usda").left_out


@pytest.mark.parametrize(
    ("corners", "faces"),
    [
        pytest.param(CORNERS, [], id="no face"),
        pytest.param(CORNERS, [(0, 1)], id="a face of two corners"),
        pytest.param([], [(0, 1, 2)], id="no corners"),
    ],
)
def test_mesh_without_faces_or_corners_is_listed(tmp_path, corners, faces):
    """A cup has two colliders, a ball and a mesh without a triangle: the mesh is listed as not taken."""
    stage = new_stage(tmp_path / "cup.usda")
    rigid_body(stage, "/cup")
    ball_collider(stage, "/cup/ball")
    collider(stage_mesh(stage, "/cup/empty", corners=corners, faces=faces))
    stage.Save()
    assert "the collider '/cup/empty': its mesh has no face" in read_scene_source(tmp_path / "cup.usda").left_out


@pytest.mark.parametrize(
    "pose",
    [
        pytest.param({"scale": 0.0}, id="no size"),
        pytest.param({"translation": (np.nan, 0.0, 0.0)}, id="no position"),
    ],
)
def test_body_without_size_or_position_is_refused(tmp_path, pose):
    """A cup with a ball has a scale of 0, or a translation that is no number."""
    stage = new_stage(tmp_path / "cup.usda")
    rigid_body(stage, "/cup", **pose)
    ball_collider(stage, "/cup/ball")
    stage.Save()
    with pytest.raises(SceneSourceError, match="/cup has a pose that is no number, or a scale of 0"):
        read_scene_source(tmp_path / "cup.usda")


def test_disabled_bodies_and_colliders_do_not_count(tmp_path):
    """The table is no rigid body any more, so that its collider "top" stands by itself; the collider "off" is none."""
    stage = new_stage(tmp_path / "s.usda")
    table = rigid_body(stage, "/table")
    UsdPhysics.RigidBodyAPI(table.GetPrim()).CreateRigidBodyEnabledAttr().Set(False)
    ball_collider(stage, "/table/top")
    off = ball_collider(stage, "/off")
    UsdPhysics.CollisionAPI(off.GetPrim()).CreateCollisionEnabledAttr().Set(False)
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    assert [(name, item.moves) for name, item in scene.bodies.items()] == [("top", False)]


def test_usd_defaults_for_unit_and_axis_are_noted(tmp_path):
    """The file states neither unit nor axis: a ball of radius 1 has 0.01 m, and +Y is up, as USD defines."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "s.usda"))
    ball_collider(stage, "/ball")
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    assert scene.notes == ("metersPerUnit is not said: 0.01, as USD defines", "upAxis is not said: Y, as USD defines")
    highest_y = scene.bodies["ball"].mesh.bounds[1, 1]
    assert highest_y == pytest.approx(0.01, rel=1e-9)
