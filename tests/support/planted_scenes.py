"""A planted scene in the axes of any program: an L-shaped tool that touches a plate at known frames.

Everything is laid out in a right-handed room (x right, y up, z back, metres) and written in another program's axes by
maps that are spelled out here, not by the product's table.
"""

from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

TO_SOURCE = {
    "canonical": lambda x, y, z: (x, y, z), "openxr": lambda x, y, z: (x, y, z), "openvr": lambda x, y, z: (x, y, z),
    "gltf": lambda x, y, z: (x, y, z), "godot": lambda x, y, z: (x, y, z), "aframe": lambda x, y, z: (x, y, z),
    "unity": lambda x, y, z: (x, y, -z), "unreal": lambda x, y, z: (-z, x, y), "ros": lambda x, y, z: (-z, -x, y),
    "z-up": lambda x, y, z: (x, -z, y), "x forward, y up": lambda x, y, z: (-z, y, x),
    "z up, left-handed": lambda x, y, z: (x, z, y),
}  # fmt: skip
"""Convention -> a point of the room in its axes."""

EXPORTERS = {
    "unity": ("x-flipped", lambda x, y, z: (-x, y, z)), "unreal": ("yz-swapped", lambda x, y, z: (x, z, y)),
    "ros": ("y-up", lambda x, y, z: (x, z, -y)), "z-up": ("y-up", lambda x, y, z: (x, z, -y)),
    "z up, left-handed": ("yz-swapped", lambda x, y, z: (x, z, y)),
}  # fmt: skip
"""Convention -> name of the exporter's turn, and what it writes of a point in the engine's axes."""

FRAMES, RATE_HZ = 120, 60.0


def changed(points, map_point):
    """Points (n, 3) mapped one by one."""
    return np.array([map_point(*point) for point in np.atleast_2d(points)])


def box(low, high):
    mesh = trimesh.creation.box(bounds=[low, high])
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def joined(*parts):
    vertices, faces, start = [], [], 0
    for points, triangles in parts:
        vertices.append(points)
        faces.append(triangles + start)
        start += len(points)
    return np.concatenate(vertices), np.concatenate(faces)


# No axis of either body is like another, so that a turned or mirrored mesh touches elsewhere or not at all.
TOOL_BOXES = [([-0.01, 0.0, -0.02], [0.01, 0.25, 0.01]), ([0.012, 0.10, -0.02], [0.13, 0.13, 0.01])]
PLATE_BOXES = [([-0.30, -0.02, -0.10], [0.12, 0.0, 0.16]), ([-0.02, 0.002, -0.10], [0.02, 0.20, -0.06])]
TOOL, PLATE = (joined(*(box(*corners) for corners in boxes)) for boxes in (TOOL_BOXES, PLATE_BOXES))
TOOL_YAW_DEG, ROOM_YAW_DEG = 40.0, 115.0


def tool_places():
    """Where the tool's foot is in the plate's axes, (n, 3): a touch, 4 cm above, a touch of the post."""
    progress = np.arange(FRAMES) / FRAMES
    height = np.interp(progress, [0, 0.15, 0.2, 0.35, 0.5, 0.6, 1], [0.1, -0.001, -0.001, 0.1, 0.04, 0.06, 0.06])
    reach = np.interp(progress, [0, 0.6, 0.8, 1], [0.06, 0.06, 0.037, 0.1])
    return np.stack([np.full(FRAMES, -0.09), height, reach], axis=1)


def poses():
    """Translations (n, 3) and rotations of the tool and of the plate, in the room."""
    room = Rotation.from_euler("y", ROOM_YAW_DEG, degrees=True)
    turn = Rotation.from_euler("y", TOOL_YAW_DEG, degrees=True)
    origin = np.array([0.2, 0.9, -0.1])
    tool = room.apply(tool_places()) + origin
    return (tool, [room * turn] * FRAMES), (np.tile(origin, (FRAMES, 1)), [room] * FRAMES)


def true_contact():
    """Frames (n,) in which a box of the tool meets one of the plate, by separating axes of upright boxes."""
    contact = np.zeros(FRAMES, dtype=bool)
    yaw = np.radians(TOOL_YAW_DEG)
    axes = [np.array([1.0, 0]), np.array([0, 1.0])]
    axes += [np.array([np.cos(yaw), -np.sin(yaw)]), np.array([np.sin(yaw), np.cos(yaw)])]  # of the turned tool, in x z
    for frame, place in enumerate(tool_places()):
        for low, high in TOOL_BOXES:
            corners = [[x, z] for x in (low[0], high[0]) for z in (low[2], high[2])]
            flat = np.array(corners) @ np.stack(axes[2:]) + place[[0, 2]]
            for plate_low, plate_high in PLATE_BOXES:
                other = np.array([[x, z] for x in (plate_low[0], plate_high[0]) for z in (plate_low[2], plate_high[2])])
                overlap = low[1] + place[1] <= plate_high[1] and plate_low[1] <= high[1] + place[1]
                for axis in axes:
                    first, second = flat @ axis, other @ axis
                    overlap &= first.min() <= second.max() and second.min() <= first.max()
                contact[frame] |= overlap
    return contact


def write_mesh(path, vertices, faces, unit=1.0):
    """A mesh file of the type that its ending says."""
    kind = path.suffix[1:]
    points = vertices / unit
    if kind == "obj":
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
        path.write_text("\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist())]))
    else:
        path.write_bytes(trimesh.Trimesh(points, faces, process=False).export(file_type=kind))


def write_scene(folder, convention, kind, *, exported=False):
    """Writes take.csv, map.toml and the two meshes; returns the axes by which the meshes are to be read."""
    folder = Path(folder)
    to_source = TO_SOURCE[convention]
    matrix = changed(np.eye(3), to_source).T
    axes, export = EXPORTERS.get(convention, ("gltf", None)) if exported else ("body", None)
    unit = 0.01 if convention == "unreal" else 1.0
    for name, (vertices, faces) in (("tool", TOOL), ("plate", PLATE)):
        points, mirrored = changed(vertices, to_source), np.linalg.det(matrix) < 0
        if exported and export is None:
            points, mirrored = vertices, False
        elif export is not None:
            points = changed(points, export)
            mirrored ^= np.linalg.det(changed(np.eye(3), export)) < 0
        scale = 1.0 if kind == "glb" else unit
        write_mesh(folder / f"{name}.{kind}", points, faces[:, ::-1] if mirrored else faces, scale)
    lines = ["t,name,x,y,z,qx,qy,qz,qw"]
    for frame in range(FRAMES):
        for name, (places, turns) in zip(("tool", "plate"), poses(), strict=True):
            place = changed(places[frame], to_source)[0] / unit
            turn = Rotation.from_matrix(matrix @ turns[frame].as_matrix() @ matrix.T).as_quat()
            lines.append(f"{frame / RATE_HZ!r},{name}," + ",".join(repr(float(one)) for one in (*place, *turn)))
    (folder / "take.csv").write_text("\n".join([*lines, ""]))
    write_mapping(folder, convention)
    return axes


def write_mapping(folder, convention):
    (folder / "map.toml").write_text(
        f'convention = "{convention}"\n[time]\ncolumn = "t"\nunit = "s"\n[body]\nname = "name"\n'
        'position = ["x", "y", "z"]\nquaternion_xyzw = ["qx", "qy", "qz", "qw"]\n'
    )
