"""Sessions with a known truth: bodies that meet and part, a letter a frame, and a scene in the axes of any program.

Random sessions are drawn from a seed: a jittered clock, lost poses, rates, contact offsets, convex pieces, searches
with small budgets, and an engine that reports in time, late, or at its own steps. The planted scene is laid out in a
right-handed room (x right, y up, z back, metres) and written in another program's axes by maps that are spelled out
here, not by the product's table.
"""

from dataclasses import dataclass, replace
from functools import cache
from itertools import groupby
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation
from support.small_worlds import cube, session_of_frames, unit_cubes_on_x

from replay.engine import compute
from sessions import MeshData, Session, Status
from sessions.model.event import LiveContact


def channel(width=0.08, length=0.06, wall=0.01):
    """A closed channel with a U for its section, open to +Y: its hull has a hollow."""
    w = h = width / 2
    inner, floor = w - wall, wall - h
    section = [(-w, -h), (w, -h), (w, h), (inner, h), (inner, floor), (-inner, floor), (-inner, h), (-w, h)]
    corners = [(x, y, z) for z in (-length / 2, length / 2) for x, y in section]
    cut = [(0, 1, 4), (1, 2, 3), (1, 3, 4), (0, 4, 5), (0, 5, 7), (5, 6, 7)]
    faces = [(a, c, b) for a, b, c in cut] + [(a + 8, b + 8, c + 8) for a, b, c in cut]
    for k in range(8):
        following = (k + 1) % 8
        faces += [(k, following, following + 8), (k, following + 8, k + 8)]
    return MeshData(corners, faces)


def rod(length=0.1, thick=0.008):
    """A thin closed box along Y."""
    box = cube(1.0)
    return MeshData(box.vertices * [thick, length, thick], box.faces)


SHAPES = {"channel": channel, "rod": rod, "block": lambda: cube(0.05), "crumb": lambda: cube(0.012)}
RATES = (11.0, 20.0, 33.0, 50.0, 90.0)
QUICK = (
    "collider[shape=hull{rate}{skin}]",
    "collider[shape=box{rate}{skin}]",
    "collider[shape=capsule{rate}{skin}]",
    "collider[shape=sphere{rate}]",
    "collider[shape=mesh{rate}{skin}]",
    "discrete[containment=true{rate}]",
    "discrete[containment=false{rate}]",
    "hybrid[containment=false]",
    "hybrid-qaco[budget=40]",
    "qaco[budget=30]",
    "sphere",
    "support.planted_detectors:Late",
    "support.planted_detectors:Dropping",
    "support.planted_detectors:FiveLate",
)
SLOW = (
    "collider[shape=compound,pieces=1{rate}{skin}]",
    "collider[shape=compound,pieces=4{rate}{skin}]",
    "collider[shape=compound,pieces=16{rate}{skin}]",
    "collider[shape=compound,pieces=32{rate}]",
    "bullet[margin_m={margin}{rate}]",
    "rapier[prediction_m={margin}{rate}]",
    "mujoco[margin_m={margin}{rate}]",
)


@dataclass(frozen=True)
class PlantedSession:
    """A session, the detectors to ask about it by label, and the oracle."""

    session: Session
    detectors: dict


def planted_session(seed, *, engines=False):
    """The session of a seed; ``engines``: with compounds and real engines among the detectors."""
    rng = np.random.default_rng([56, seed])
    stamps = np.cumsum(rng.uniform(0.6, 1.4, int(rng.integers(60, 160))) * 1e9 / rng.choice([45.0, 72.0, 90.0]))
    stamps = (stamps + rng.integers(0, 10**12)).astype(np.int64)
    names = ["channel", *rng.choice(["rod", "block", "crumb"], int(rng.integers(1, 3)), replace=False)]
    poses = [path(rng, stamps, moves=number > 0) for number in range(len(names))]
    positions, quaternions = (np.stack(piece, axis=1) for piece in zip(*poses, strict=True))
    status = np.where(np.isnan(positions).any(axis=2), Status.LOST, Status.VALID)
    posed = session_of_frames(stamps, status, np.nan_to_num(positions), quaternions, names)
    session = replace(posed, meshes={name: SHAPES[name]() for name in names})
    session = with_reports(rng, session)
    kinds = [*QUICK, *(SLOW if engines else ())]
    chosen = rng.choice(len(kinds), int(rng.integers(3, 6)), replace=False)
    detectors = {f"d{k}": detector(rng, kinds[k]) for k in chosen}
    if session.live_contacts:
        detectors["engine"] = "recorded"
    if engines and rng.random() < 0.4:
        # Alone, their figures were once taken for each other's.
        rate = f",rate_hz={rng.choice(RATES)}"
        detectors |= {f"u{n}": f"collider[shape=compound,pieces={n}{rate}]" for n in (1, 4, 16)}
    return PlantedSession(session, detectors)


def detector(rng, form):
    """A detector of a form, with or without a rate and a contact offset."""
    rate = f",rate_hz={rng.choice(RATES)}" if rng.random() < 0.7 else ""
    skin = f",skin_m={rng.choice([0.001, 0.004, 0.008])}" if rng.random() < 0.4 else ""
    return form.format(rate=rate, skin=skin, margin=rng.choice([0.0, 0.001, 0.005])).replace("[,", "[")


def path(rng, stamps, *, moves):
    """Positions (T, 3) and quaternions (T, 4) of a body that comes to the middle and leaves it, some poses lost."""
    seconds = (stamps - stamps[0]) / 1e9
    if not moves:
        return np.zeros((len(stamps), 3)), np.tile([0.0, 0.0, 0.0, 1.0], (len(stamps), 1))
    swing = np.sin(2 * np.pi * (rng.uniform(0.8, 3.0) * seconds + rng.random()))
    positions = 0.012 * rng.normal(size=3) + np.outer(swing, 0.09 * rng.normal(size=3))
    rotations = np.column_stack(
        [0.2 * np.sin(seconds[:, None] * rng.uniform(1, 4, 3) + rng.random(3)), np.ones(len(seconds))]
    )
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    if rng.random() < 0.3:
        first = int(rng.integers(5, len(stamps) - 8))
        positions[first : first + int(rng.integers(1, 6))] = np.nan
    return positions, rotations


def with_reports(rng, session):
    """The session, in half of the seeds with what an engine reports of its true contacts."""
    if rng.random() < 0.5:
        return session
    result = compute(session, detectors="exact", oracle="none", offline=True)
    delay, hertz = rng.choice([0.0, 0.0, 0.03]), rng.choice([0.0, 50.0, 30.0])
    reports = []
    for contact in result.episodes["exact"]:
        a, b = result.assembly.bodies_of(contact.pair)
        moments = np.array([contact.start, contact.end]) + rng.choice([0.0, 0.0, 0.04], 2)
        if hertz:
            moments = np.ceil(moments * hertz) / hertz
        if moments[0] < moments[1]:
            for seconds, phase in zip(moments + delay, ("enter", "exit"), strict=True):
                reports.append(LiveContact(result.assembly.first_ns + round(1e9 * seconds), a, b, phase))
    return replace(session, live_contacts=tuple(sorted(reports, key=lambda report: report.time_ns)))


FALSE = "% of its contact time is false."
IT = "support.planted_detectors:Scripted (it):"
STATES = {
    # state: (oracle, subject, headline)
    "none": ("......", "nnnnnn", "No contact happened, and it reported none."),
    "one": (".CC...", "nnnnnn", f"{IT} 1 of 1 contact missed."),
    "several": ("C.C.CC", "nncncn", f"{IT} 1 of 3 contacts missed, 1 late or cut short."),
    "undecided": (".C.CC.", "nunuun", f"{IT} 2 of 2 contacts undecided."),
    "not measured": ("......", "uuuuuu", "Nothing compared: exact and it decided no pair-frame of 6 together."),
    "more invented than found": ("C.....", "cnccnc", f"{IT} 75 {FALSE}"),
    "false at both ends": ("..CC..C.", "nccccccn", f"{IT} 50 {FALSE}"),
    "more than a list holds": ("C." * 22, "n" * 44, f"{IT} 22 of 22 contacts missed."),
}


@cache
def run(state):
    """A run of two cubes whose contact and reports are those of a state, letter by letter."""
    truth, answer, _ = STATES[state]
    positions = [0.99 if letter == "C" else 1.01 + 0.02 * (k % 2) for k, letter in enumerate(truth)]
    session = unit_cubes_on_x({"a": [0.0] * len(truth), "b": positions})
    return compute(session, detectors=f"it=support.planted_detectors:Scripted[says={answer}]")


def runs_of(codes):
    """First frame, number of frames, and value of each stretch of equal letters."""
    first = 0
    for value, same in groupby(codes):
        count = len(list(same))
        yield first, count, value
        first += count


def outcomes(truth, reported):
    """A word for each frame."""
    pairs = {("C", "c"): "both", ("C", "n"): "MISSED", (".", "c"): "false"}
    return [
        "left out" if mine == "u" else pairs.get((own, mine), "") for own, mine in zip(truth, reported, strict=True)
    ]


def missed(truth, reported):
    """Contact from 1, first frame and number of frames of each miss."""
    contacts = [(first, count) for first, count, value in runs_of(truth) if value == "C"]
    outcome = outcomes(truth, reported)
    return len(contacts), [
        (number, begin + first, count)
        for number, (begin, length) in enumerate(contacts, 1)
        for first, count, word in runs_of(outcome[begin : begin + length])
        if word == "MISSED"
    ]


TO_SOURCE = {
    "canonical": lambda x, y, z: (x, y, z), "openxr": lambda x, y, z: (x, y, z), "openvr": lambda x, y, z: (x, y, z),
    "gltf": lambda x, y, z: (x, y, z), "godot": lambda x, y, z: (x, y, z), "aframe": lambda x, y, z: (x, y, z),
    "unity": lambda x, y, z: (x, y, -z), "unreal": lambda x, y, z: (-z, x, y), "ros": lambda x, y, z: (-z, -x, y),
    "z-up": lambda x, y, z: (x, -z, y), "x forward, y up": lambda x, y, z: (-z, y, x),
    "z up, left-handed": lambda x, y, z: (x, z, y),
}  # fmt: skip
"""Convention -> a point of the room in its axes."""

EXPORTERS = {
    "unity": ("x-flipped", lambda x, y, z: (-x, y, z)),
    "unreal": ("yz-swapped", lambda x, y, z: (x, z, y)),
    "ros": ("y-up", lambda x, y, z: (x, z, -y)),
    "z-up": ("y-up", lambda x, y, z: (x, z, -y)),
    "z up, left-handed": ("yz-swapped", lambda x, y, z: (x, z, y)),
}
"""Convention -> name of the exporter's turn, and what it writes of a point in the engine's axes."""

FRAMES, RATE_HZ = 120, 60.0


def changed(points, map_point):
    """Points (n, 3) mapped one by one."""
    return np.array([map_point(*point) for point in np.atleast_2d(points)])


def box(least, greatest):
    """Vertices and faces of a box between two corners."""
    mesh = trimesh.creation.box(bounds=[least, greatest])
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def joined(*solids):
    """Vertices and faces of several solids in one mesh."""
    vertices, faces, start = [], [], 0
    for points, triangles in solids:
        vertices.append(points)
        faces.append(triangles + start)
        start += len(points)
    return np.concatenate(vertices), np.concatenate(faces)


# No axis of either body is like another, so that a turned or mirrored mesh touches elsewhere or not at all.
TOOL_BOXES = [([-0.01, 0.0, -0.02], [0.01, 0.25, 0.01]), ([0.012, 0.10, -0.02], [0.13, 0.13, 0.01])]
PLATE_BOXES = [([-0.30, -0.02, -0.10], [0.12, 0.0, 0.16]), ([-0.02, 0.002, -0.10], [0.02, 0.20, -0.06])]
TOOL, PLATE = (joined(*(box(*corners) for corners in boxes)) for boxes in (TOOL_BOXES, PLATE_BOXES))
TOOL_YAW_DEG, ROOM_YAW_DEG = 40.0, 115.0


def tool_positions():
    """Positions of the tool's foot in the plate's axes, (n, 3): a touch, 4 cm above, a touch of the post."""
    progress = np.arange(FRAMES) / FRAMES
    height = np.interp(progress, [0, 0.15, 0.2, 0.35, 0.5, 0.6, 1], [0.1, -0.001, -0.001, 0.1, 0.04, 0.06, 0.06])
    reach = np.interp(progress, [0, 0.6, 0.8, 1], [0.06, 0.06, 0.037, 0.1])
    return np.stack([np.full(FRAMES, -0.09), height, reach], axis=1)


def poses():
    """Translations (n, 3) and the rotation, the same in every frame, of the tool and of the plate in the room."""
    room = Rotation.from_euler("y", ROOM_YAW_DEG, degrees=True)
    rotation = Rotation.from_euler("y", TOOL_YAW_DEG, degrees=True)
    origin = np.array([0.2, 0.9, -0.1])
    tool = room.apply(tool_positions()) + origin
    return (tool, room * rotation), (np.tile(origin, (FRAMES, 1)), room)


@cache
def true_contact():
    """Frames (n,) in which a box of the tool meets one of the plate, by separating axes of upright boxes."""
    contact = np.zeros(FRAMES, dtype=bool)
    yaw = np.radians(TOOL_YAW_DEG)
    axes = [np.array([1.0, 0]), np.array([0, 1.0])]
    axes += [np.array([np.cos(yaw), -np.sin(yaw)]), np.array([np.sin(yaw), np.cos(yaw)])]  # of the turned tool, in x z
    for frame, position in enumerate(tool_positions()):
        for lower, upper in TOOL_BOXES:
            corners = [[x, z] for x in (lower[0], upper[0]) for z in (lower[2], upper[2])]
            flat = np.array(corners) @ np.stack(axes[2:]) + position[[0, 2]]
            for plate_lower, plate_upper in PLATE_BOXES:
                other = np.array(
                    [[x, z] for x in (plate_lower[0], plate_upper[0]) for z in (plate_lower[2], plate_upper[2])]
                )
                overlap = lower[1] + position[1] <= plate_upper[1] and plate_lower[1] <= upper[1] + position[1]
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
    columns = []
    for positions, rotation in poses():
        quaternion = Rotation.from_matrix(matrix @ rotation.as_matrix() @ matrix.T).as_quat()
        columns.append(np.column_stack([changed(positions, to_source) / unit, np.tile(quaternion, (FRAMES, 1))]))
    lines = ["t,name,x,y,z,qx,qy,qz,qw"]
    for frame in range(FRAMES):
        for name, rows in zip(("tool", "plate"), columns, strict=True):
            lines.append(f"{frame / RATE_HZ!r},{name}," + ",".join(map(repr, rows[frame].tolist())))
    (folder / "take.csv").write_text("\n".join([*lines, ""]))
    write_mapping(folder, convention)
    return axes


def write_mapping(folder, convention):
    """Write the mapping of a CSV with a body's name in each row."""
    (folder / "map.toml").write_text(
        f'convention = "{convention}"\n[time]\ncolumn = "t"\nunit = "s"\n[body]\nname = "name"\n'
        'position = ["x", "y", "z"]\nquaternion_xyzw = ["qx", "qy", "qz", "qw"]\n'
    )
