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
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 4), (2, 3, 4), (3, 1, 4)]
UNIT = 0.01


@pytest.fixture(autouse=True)
def without_trial(monkeypatch):
    """Binary layers are read at once: none of these files ends the library, and another process takes 0.4 s."""
    monkeypatch.setattr("sessions.scene_formats.usd_layers.try_scene", lambda path, root: None)


def new_stage(path, *, up="Z", unit=UNIT):
    """An empty stage of USD."""
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


@pytest.fixture
def bench_file(tmp_path):
    """A cup of two colliders on a table, and a rack of every round shape."""
    path = tmp_path / "bench.usda"
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


def test_usd_body_poses_and_colliders_agree_with_pxr(bench_file):
    """Poses to 1e-9 m by USD's own cache; lengths are in centimetres, and one collider is mirrored."""
    scene, stage = read_scene_source(bench_file), Usd.Stage.Open(str(bench_file))
    assert [*scene.bodies] == ["cup", "table", "rack"] and scene.format == "USD"
    assert {name: item.moves for name, item in scene.bodies.items()} == {"cup": True, "table": False, "rack": True}
    assert scene.bodies["cup"].mass == 0.25 and scene.bodies["table"].mass is None
    for path in ("/World/cup", "/World/rack"):
        own = UsdGeom.XformCache().GetLocalToWorldTransform(stage.GetPrimAtPath(path)).RemoveScaleShear()
        pose = scene.bodies[path.rpartition("/")[2]].pose
        assert np.abs(pose[:3, :3] - np.array(own.ExtractRotationMatrix()).T).max() <= 1e-9
        assert np.abs(pose[:3, 3] - UNIT * np.array(own.ExtractTranslation())).max() <= 1e-9
    wall, handle = scene.bodies["cup"].colliders
    corners = np.array(CORNERS, dtype=np.float32)
    assert (
        np.abs(corners_in_world(scene.bodies["cup"], wall) - in_world(stage, "/World/cup/wall", corners[:4])).max()
        <= 1e-9
    )
    inner = corners_in_world(scene.bodies["cup"], handle)
    assert np.abs(inner - in_world(stage, "/World/cup/inner/handle", corners)).max() <= 1e-9
    assert wall.volume > 0.0 and handle.volume > 0.0  # a mirror turns no face inside out
    assert scene.notes == ("lengths times 0.01 (metersPerUnit)",)


def test_round_colliders_have_the_sizes_of_the_library(bench_file):
    """Vertices lie at the radius that USD's own parser reads: of a sphere, of a capsule's axis, of caps and side."""
    scene, stage = read_scene_source(bench_file), Usd.Stage.Open(str(bench_file))
    load = getattr(UsdPhysics, "UsdPhysicsLoadStageFromPrimRange", None) or UsdPhysics.LoadUsdPhysicsFromRange
    parsed = load(stage, ["/"])
    sizes = {}
    for kind in ("SphereShape", "CapsuleShape", "CylinderShape", "ConeShape"):
        paths, rows = parsed[getattr(UsdPhysics.ObjectType, kind)]
        sizes |= {path.name: row for path, row in zip(paths, rows, strict=True)}
    assert len(sizes) == 5
    rack, solids = scene.bodies["rack"], scene.bodies["rack"].colliders
    for solid, (name, row) in zip(solids, ((name, sizes[name]) for name in [*_names(stage)]), strict=True):
        pose = UsdGeom.XformCache().GetLocalToWorldTransform(stage.GetPrimAtPath(f"/World/rack/{name}"))
        rigid = np.array(pose.RemoveScaleShear())
        local = (corners_in_world(rack, solid) - UNIT * rigid[3, :3]) @ rigid[:3, :3].T
        radius, half = UNIT * row.radius, UNIT * getattr(row, "halfHeight", 0.0)
        along = "XYZ".index(name[-1]) if half else 0
        side, axial = np.linalg.norm(np.delete(local, along, axis=1), axis=1), local[:, along]
        if name.startswith("Sphere"):
            assert np.abs(np.linalg.norm(local, axis=1) - radius).max() <= 1e-9
        elif name.startswith("Capsule"):
            beyond = axial - np.clip(axial, -half, half)
            assert np.abs(np.hypot(side, beyond) - radius).max() <= 1e-9
        else:
            lower = radius if name.startswith("Cone") else side.max()
            assert np.abs(np.abs(axial) - half).max() <= 1e-9 and abs(side.max() - radius) <= 1e-9
            assert abs(side[axial < 0].max() - lower) <= 1e-9
            if name.startswith("Cone"):
                assert side[axial > 0].max() <= 1e-9  # its tip points along the axis
    table = scene.bodies["table"]
    half_extents = np.array(parsed[UsdPhysics.ObjectType.CubeShape][1][0].halfExtents, dtype=np.float64)
    assert np.abs(np.ptp(table.mesh.vertices, axis=0) - 2 * UNIT * half_extents).max() <= 1e-9


def _names(stage):
    """Names of the bodies in the rack."""
    return [prim.GetName() for prim in stage.GetPrimAtPath("/World/rack").GetChildren()]


@pytest.mark.parametrize(
    ("approximation", "corners", "sentence"),
    [
        ("none", 5, ""),
        ("convexHull", 4, ""),
        ("convexDecomposition", 5, "an engine cuts itself"),
        ("meshSimplification", 5, "an engine makes itself"),
        ("boundingCube", 8, "an engine may rotate"),
        ("boundingSphere", 0, "an engine may shrink"),
        ("sdf", None, "its mesh collides as 'sdf'"),
        ("sphereFill", None, "its mesh collides as 'sphereFill'"),
    ],
)
def test_mesh_collides_as_its_file_says(tmp_path, approximation, corners, sentence):
    """``corners``: of the collider of a mesh with five, one of them inside; 0 for a ball about the unit cube."""
    stage = new_stage(tmp_path / "s.usda", unit=1.0)
    rigid_body(stage, "/cup", translation=(1, 2, 3))
    collider(stage_mesh(stage, "/cup/wall"), approximation=approximation)
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    assert sentence in " ".join(scene.left_out) and bool(scene.left_out) == bool(sentence)
    solids = scene.bodies["cup"].colliders
    if corners is None:
        assert solids == () and len(scene.bodies["cup"].mesh.vertices) == 5
    elif corners:
        assert len(solids[0].vertices) == corners
    else:
        away = np.linalg.norm(solids[0].vertices - 0.5, axis=1)
        assert np.abs(away - np.sqrt(0.75)).max() <= 1e-6


@pytest.mark.parametrize("kind", ["filtered body", "filtered collider", "group", "joint", "articulation"])
def test_pairs_that_never_meet_are_excluded(tmp_path, kind):
    """Arm and hand are excluded in each way that USD has; an articulation excludes all of its bodies."""
    stage = new_stage(tmp_path / "s.usda")
    for number, name in enumerate(("arm", "hand", "cup")):
        rigid_body(stage, f"/world/{name}", translation=(number * 10, 0, 0))
        ball_collider(stage, f"/world/{name}/shape")
    arm, shape = stage.GetPrimAtPath("/world/arm"), stage.GetPrimAtPath("/world/arm/shape")
    if kind.startswith("filtered"):
        target = "/world/hand" if kind == "filtered body" else "/world/hand/shape"
        UsdPhysics.FilteredPairsAPI.Apply(arm if kind == "filtered body" else shape).CreateFilteredPairsRel().AddTarget(
            target
        )
    elif kind == "group":
        for name, filtered in (("arm", "hand"), ("hand", "arm")):
            group = UsdPhysics.CollisionGroup.Define(stage, f"/groups/{name}")
            group.GetCollidersCollectionAPI().CreateIncludesRel().AddTarget(f"/world/{name}")
            group.CreateFilteredGroupsRel().AddTarget(f"/groups/{filtered}")
    elif kind == "joint":
        joint = UsdPhysics.RevoluteJoint.Define(stage, "/world/wrist")
        joint.CreateBody0Rel().AddTarget("/world/arm")
        joint.CreateBody1Rel().AddTarget("/world/hand/shape")
    else:
        root = stage.GetPrimAtPath("/world")
        root.CreateAttribute("physxArticulation:enabledSelfCollisions", Sdf.ValueTypeNames.Bool).Set(False)
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    every = (("arm", "hand"), ("arm", "cup"), ("hand", "cup"))
    assert scene.excluded == (every if kind == "articulation" else every[:1])
    assert ("joints (1 PhysicsRevoluteJoint)" in " ".join(scene.left_out)) == (kind == "joint")


@pytest.mark.parametrize(("collides", "is_enabled"), [(True, True), (False, False)])
def test_joint_that_lets_bodies_collide_excludes_no_pair(tmp_path, collides, is_enabled):
    """A joint that enables collision, and one that is switched off."""
    stage = new_stage(tmp_path / "s.usda")
    for number, name in enumerate(("arm", "hand")):
        rigid_body(stage, f"/world/{name}", translation=(number * 10, 0, 0))
        ball_collider(stage, f"/world/{name}/shape")
    joint = UsdPhysics.RevoluteJoint.Define(stage, "/world/wrist")
    joint.CreateBody0Rel().AddTarget("/world/arm")
    joint.CreateBody1Rel().AddTarget("/world/hand")
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


def test_articulation_with_self_collisions_excludes_no_pair(tmp_path):
    """Arm and hand are of one articulation whose bodies may collide."""
    stage = new_stage(tmp_path / "s.usda")
    for number, name in enumerate(("arm", "hand")):
        rigid_body(stage, f"/world/{name}", translation=(number * 10, 0, 0))
        ball_collider(stage, f"/world/{name}/shape")
    root = stage.GetPrimAtPath("/world")
    root.CreateAttribute("physxArticulation:enabledSelfCollisions", Sdf.ValueTypeNames.Bool).Set(True)
    stage.Save()
    assert read_scene_source(tmp_path / "s.usda").excluded == ()


def test_usd_filter_of_single_colliders_is_listed_as_unsupported(tmp_path):
    """Bodies with two colliders each: a filter of one of them would not exclude the pair of bodies."""
    stage = new_stage(tmp_path / "s.usda")
    for name in ("arm", "cup"):
        rigid_body(stage, f"/{name}")
        for child in ("a", "b"):
            ball_collider(stage, f"/{name}/{child}")
    UsdPhysics.FilteredPairsAPI.Apply(stage.GetPrimAtPath("/arm/a")).CreateFilteredPairsRel().AddTarget("/cup")
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    assert scene.excluded == () and "some colliders of 'arm' and 'cup' meet" in " ".join(scene.left_out)


def test_offsets_become_margins(tmp_path):
    """A contact offset of 2 cm is a margin of 0.02 m, an infinite one is none; a rest offset is listed."""
    stage = new_stage(tmp_path / "s.usda")
    for name, contact, rest in (("cup", 2.0, 0.0), ("tray", float("-inf"), 1.0)):
        rigid_body(stage, f"/{name}")
        prim = ball_collider(stage, f"/{name}/shape").GetPrim()
        prim.CreateAttribute("physxCollision:contactOffset", Sdf.ValueTypeNames.Float).Set(contact)
        prim.CreateAttribute("physxCollision:restOffset", Sdf.ValueTypeNames.Float).Set(rest)
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    assert [item.margin for item in scene.bodies.values()] == [0.02, 0.0]
    assert scene.left_out == ("the rest offset of 'tray'",)


def test_drawn_surface_and_hidden_colliders_are_distinguished(tmp_path):
    """The drawn mesh has 5 vertices, the hidden cube 8; a caller may take the colliding surface."""
    stage = new_stage(tmp_path / "s.usda", unit=1.0)
    rigid_body(stage, "/cup")
    stage_mesh(stage, "/cup/drawn")
    hidden = collider(UsdGeom.Cube.Define(stage, "/cup/solid"), translation=(0.5, 0.5, 0.5), scale=(0.5, 0.5, 0.5))
    hidden.GetPurposeAttr().Set("guide")
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    assert len(scene.bodies["cup"].mesh.vertices) == 5 and scene.bodies["cup"].surface == "drawn"
    assert len(scene.bodies["cup"].colliders[0].vertices) == 8
    colliding = read_scene_source(tmp_path / "s.usda", surface=Surface.COLLIDING)
    assert len(colliding.bodies["cup"].mesh.vertices) == 8


def test_instances_and_referenced_layers_are_bodies_of_their_own(tmp_path):
    """Two cups refer to one layer and are instances, 1 and 2 m along x."""
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
    assert {name: item.pose[0, 3] for name, item in scene.bodies.items()} == {"left/cup": 1.0, "right/cup": 2.0}
    assert scene.notes == ("names that are there more than once: 'left/cup' for 'cup', 'right/cup' for 'cup'",)


@pytest.mark.parametrize(("up", "ending"), [("Y", "usda"), ("Z", "usdc"), ("Z", "usd")])
def test_time_samples_become_poses(tmp_path, up, ending):
    """50 time codes a second from code 10 on: 20 ms a code; positions in centimetres.

    The cup has samples at codes 10, 11 and 13, its carrier at 10 and 14: the cup has a pose at each of the four, where
    USD itself places it. The tray has no samples and stays in place.
    """
    path = tmp_path / f"motion.{ending}"
    stage = new_stage(path, up=up)
    stage.SetTimeCodesPerSecond(50)
    carrier = UsdGeom.Xform.Define(stage, "/carrier")
    shift = carrier.AddTranslateOp()
    for code in (10, 14):
        shift.Set(Gf.Vec3d(code, 2 * code, 0), code)
    cup = rigid_body(stage, "/carrier/cup", scale=2.0)
    for code in (10, 11, 13):
        cup.GetOrderedXformOps()[1].Set(Gf.Vec3f(code, 2 * code, 3 * code), code)
    ball_collider(stage, "/carrier/cup/shape")
    rigid_body(stage, "/tray")
    ball_collider(stage, "/tray/shape")
    stage.Save()
    session = import_session("auto", path)
    track = session.tracks["cup"]
    assert track.times_ns.tolist() == [0, 20_000_000, 60_000_000, 80_000_000] and [*session.tracks] == ["cup"]
    world = np.eye(3) if up == "Y" else np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    for row, code in enumerate((10, 11, 13, 14)):
        own = UsdGeom.XformCache(code).GetLocalToWorldTransform(stage.GetPrimAtPath("/carrier/cup")).RemoveScaleShear()
        rotation = world @ np.array(own.ExtractRotationMatrix()).T
        assert np.abs(Rotation.from_quat(track.quaternions_xyzw[row]).as_matrix() - rotation).max() <= 1e-9
        assert np.abs(track.positions[row] - world @ own.ExtractTranslation() * UNIT).max() <= 1e-9
    assert session.scene.body("tray").fixed is not None and session.scene.body("cup").fixed is None
    assert ("world +Z up" in session.facts["conversions"]) == (up == "Z")


RACK = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
"""The outline of a U, whose arms a fan of the first corner would join."""


def test_concave_faces_are_cut_inside_their_outline(tmp_path):
    """The U has an area of 7 and an outline of 16 units, and is 1 unit deep."""
    stage = new_stage(tmp_path / "rack.usda")
    count = len(RACK)
    sides = [(at, (at + 1) % count, count + (at + 1) % count, count + at) for at in range(count)]
    faces = [tuple(reversed(range(count))), tuple(range(count, 2 * count)), *sides]
    rigid_body(stage, "/rack")
    collider(stage_mesh(stage, "/rack/u", corners=[(x, y, z) for z in (0, 1) for x, y in RACK], faces=faces))
    stage.Save()
    rack = read_scene_source(tmp_path / "rack.usda").bodies["rack"].mesh
    sides = np.cross(*(rack.triangles[:, at] - rack.triangles[:, 0] for at in (1, 2)))
    area = np.linalg.norm(sides, axis=1).sum() / 2.0
    assert area == pytest.approx((2 * 7 + 16) * UNIT**2, rel=1e-6)
    assert rack.volume == pytest.approx(7 * UNIT**3, rel=1e-6)


def test_holes_of_a_usd_mesh_are_no_faces(tmp_path):
    """Indices of no face are passed over."""
    stage = new_stage(tmp_path / "shell.usda")
    rigid_body(stage, "/shell")
    shell = collider(stage_mesh(stage, "/shell/mesh"))
    shell.GetHoleIndicesAttr().Set([1, 4, len(FACES), -1])
    stage.Save()
    faces = read_scene_source(tmp_path / "shell.usda").bodies["shell"].mesh.faces
    assert faces.tolist() == [[*face] for index, face in enumerate(FACES) if index not in (1, 4)]


@pytest.mark.parametrize(("per_second", "frames"), [(60, 60), (1000, 25)])
def test_bodies_are_posed_between_their_time_samples(tmp_path, per_second, frames):
    """One body is keyed at its ends alone, the other halfway too: both are there in every frame, as USD has them."""
    stage = new_stage(tmp_path / "keys.usda", up="Y", unit=1.0)
    stage.SetTimeCodesPerSecond(per_second)
    stage.SetFramesPerSecond(frames)
    for name, codes in (("rod", (0, 2)), ("cup", (0, 1, 2))):
        prim = rigid_body(stage, f"/{name}")
        for second in codes:
            prim.GetOrderedXformOps()[0].Set(Gf.Vec3d(second, second**2, 0), second * per_second)
            prim.GetOrderedXformOps()[1].Set(Gf.Vec3f(0, 0, 90 * second), second * per_second)
        ball_collider(stage, f"/{name}/shape")
    stage.Save()
    session = import_session("usd", tmp_path / "keys.usda")
    for name, track in session.tracks.items():
        assert len(track.times_ns) == 2 * frames + 1 and track.valid.all()
        for row, nanoseconds in enumerate(track.times_ns.tolist()):
            cache = UsdGeom.XformCache(nanoseconds / 1e9 * per_second)
            own = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(f"/{name}"))
            assert np.abs(track.positions[row] - own.ExtractTranslation()).max() <= 1e-6
            turned = Rotation.from_quat(track.quaternions_xyzw[row]).as_matrix()
            assert np.abs(turned - np.array(own.ExtractRotationMatrix()).T).max() <= 1e-6
    assert "as USD interpolates" in session.facts["conversions"]


def test_poses_of_a_usd_scene_are_limited(tmp_path, monkeypatch):
    """A body in 3 time samples has 3 poses: as many as allowed, and one more than where 2 are."""
    stage = new_stage(tmp_path / "long.usda")
    cup = rigid_body(stage, "/cup")
    for code in (0, 1, 2):
        cup.GetOrderedXformOps()[0].Set(Gf.Vec3d(code, 0, 0), code)
    ball_collider(stage, "/cup/shape")
    stage.Save()
    monkeypatch.setattr("sessions.scene_formats.usd_physics.MOST_POSES", 3)
    assert len(import_session("usd", tmp_path / "long.usda").frames) == 3
    monkeypatch.setattr("sessions.scene_formats.usd_physics.MOST_POSES", 2)
    with pytest.raises(SessionError, match="more than 2 poses; shorten it"):
        import_session("usd", tmp_path / "long.usda")


def test_unsupported_usd_subdivision_is_listed(tmp_path):
    """Two meshes of a cup: only the smooth one is subdivided."""
    stage = new_stage(tmp_path / "smooth.usda")
    rigid_body(stage, "/cup")
    for name, scheme in (("smooth", "catmullClark"), ("plain", "none")):
        collider(stage_mesh(stage, f"/cup/{name}")).GetSubdivisionSchemeAttr().Set(scheme)
    stage.Save()
    assert read_scene_source(tmp_path / "smooth.usda").left_out == (
        "the subdivision of '/cup/smooth': its polygons are taken as they are",
    )


def test_usd_without_time_samples_is_refused_as_a_recording(bench_file):
    """The bench is a scene at rest."""
    with pytest.raises(SessionError, match="time samples; take the scene"):
        import_session("usd", bench_file)


def test_moving_usd_body_without_a_readable_mesh_names_the_cause(tmp_path):
    """A face of the mesh names vertex 99, which does not exist."""
    stage = new_stage(tmp_path / "s.usda")
    cup = rigid_body(stage, "/cup")
    for code in (1, 2):
        cup.GetOrderedXformOps()[0].Set((code, 0, 0), code)
    collider(stage_mesh(stage, "/cup/m")).GetFaceVertexIndicesAttr().Set([0, 1, 99])
    stage.Save()
    with pytest.raises(SessionError, match=r"not taken: the collider '/cup/m': .*; take the scene"):
        import_session("usd", tmp_path / "s.usda")


def test_unsupported_usd_physics_is_listed_prim_by_prim(tmp_path):
    """Values at times 1 and 2 are motions; PhysX's schemas make a soft body and a trigger."""
    stage = new_stage(tmp_path / "s.usda")
    cup = rigid_body(stage, "/cup")
    scale = cup.GetOrderedXformOps()[2]
    for code in (1, 2):
        scale.Set(Gf.Vec3f(code), code)
    shape = ball_collider(stage, "/cup/shape")
    shape.GetRadiusAttr().Set(2.0, 1)
    shape.GetRadiusAttr().Set(3.0, 2)
    lid = ball_collider(stage, "/cup/lid")
    lid.GetOrderedXformOps()[0].Set(Gf.Vec3d(1, 2, 3), 3)
    collider(UsdGeom.Plane.Define(stage, "/ground"))
    soft = stage_mesh(stage, "/cloth").GetPrim()
    soft.AddAppliedSchema("PhysxDeformableSurfaceAPI")
    zone = ball_collider(stage, "/zone").GetPrim()
    zone.AddAppliedSchema("PhysxTriggerAPI")
    UsdGeom.PointInstancer.Define(stage, "/grass")
    UsdPhysics.CollisionAPI.Apply(UsdGeom.Xform.Define(stage, "/group").GetPrim())
    rigid_body(stage, "/ghost")
    stage_mesh(stage, "/ghost/drawn")
    broken = collider(stage_mesh(stage, "/cup/broken", faces=[(0, 1, 9)]))
    assert broken
    stage.Save()
    left_out = " ".join(import_session("usd", tmp_path / "s.usda").facts["conversions"].split("; "))
    for sentence in (
        "the scale of 'cup', which changes",
        "the changing shape of '/cup/shape'",
        "the motion of '/cup/lid' within 'cup'",
        "the collider '/ground': an endless plane",
        "the soft body '/cloth'",
        "the trigger '/zone'",
        "the instances of point instancer '/grass'",
        "the collider '/group': a shape 'Xform'",
        "the body 'ghost', of which nothing collides",
        "the collider '/cup/broken': face 0 names vertex",
    ):
        assert sentence in left_out


@pytest.mark.parametrize("counts", [[4, 3, 3, 3], [3, 3, 3], [3, 3, 3, 3, 3, -3]])
def test_mesh_of_contradicting_face_counts_is_listed(tmp_path, counts):
    """The mesh has four triangles, so 12 indices; the last counts have that sum and are no counts of corners."""
    stage = new_stage(tmp_path / "cup.usda")
    rigid_body(stage, "/cup")
    ball_collider(stage, "/cup/ball")
    tetrahedron = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
    collider(stage_mesh(stage, "/cup/torn", faces=tetrahedron)).GetFaceVertexCountsAttr().Set(counts)
    stage.Save()
    sentence = f"the collider '/cup/torn': its mesh has 12 indices, and its faces count {sum(counts)}"
    assert sentence in read_scene_source(tmp_path / "cup.usda").left_out


@pytest.mark.parametrize(("corners", "faces"), [(CORNERS, []), (CORNERS, [(0, 1)]), ([], [(0, 1, 2)])])
def test_mesh_without_faces_or_corners_is_listed(tmp_path, corners, faces):
    """No face, a face of two corners, and faces of no corners, beside a ball."""
    stage = new_stage(tmp_path / "cup.usda")
    rigid_body(stage, "/cup")
    ball_collider(stage, "/cup/ball")
    collider(stage_mesh(stage, "/cup/empty", corners=corners, faces=faces))
    stage.Save()
    assert "the collider '/cup/empty': its mesh has no face" in read_scene_source(tmp_path / "cup.usda").left_out


@pytest.mark.parametrize("pose", [{"scale": 0.0}, {"translation": (np.nan, 0.0, 0.0)}])
def test_body_without_size_or_position_is_refused(tmp_path, pose):
    """A scale of 0, and a translation that is no number."""
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
    """The file states neither: a ball of radius 1 has 0.01 m, and +Y is up."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "s.usda"))
    ball_collider(stage, "/ball")
    stage.Save()
    scene = read_scene_source(tmp_path / "s.usda")
    assert scene.notes == ("metersPerUnit is not said: 0.01, as USD defines", "upAxis is not said: Y, as USD defines")
    assert scene.bodies["ball"].mesh.bounds[1, 1] == pytest.approx(0.01, rel=1e-9)
