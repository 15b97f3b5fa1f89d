"""A scene as TOML text; every mistake and every unknown key is named with file and table."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from sessions.errors import SceneError, SessionError
from sessions.geometry.shapes import DEFAULT_FACES, MOST_FACES, SIZES
from sessions.input_files import TomlTable, is_number, nearest, parse_toml, read_text
from sessions.meshes.conventions import CONVENTIONS, quaternion_from_euler
from sessions.meshes.mesh_axes import mesh_axes_matrix
from sessions.model.constants import SPACE_RADIUS
from sessions.model.scene import TAG, Pose, Scene, SceneBody, SceneEffect, SceneGroup, selected_bodies
from sessions.quantities import number

EXTRA_KEYS = ("mass", "margin", "cavity", "faces", "options", "properties")
"""Keys of a body that are kept as written: ``faces`` and ``options`` for its mesh, the others for effects."""

Selected = Mapping[str, list[str]]
"""Id, group or ``tag:WORD`` -> names of the bodies that it stands for."""

MOST_PAIRS = 250_000
"""Two words may name every body of thousands: a scene is to take memory and time by its size."""
IDENTITY: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)


def read_scene(path: str | Path) -> Scene:
    """The scene of a TOML file; errors as in `parse_scene`."""
    return parse_scene(read_text(path, "scene", SceneError), Path(path).name)


def parse_scene(text: str, file: str = "scene.toml", recorded: Scene | None = None) -> Scene:
    """The scene of a TOML text; ``file`` is the name used in messages.

    ``recorded``: what a scene that declares no body adds to; the bodies and groups that it names are that one's. Of a
    scene with ``from`` it holds the bodies of that file, beside which the text's own stand. A scene that declares
    bodies and no group may name its groups.

    Raises ``SceneError``: file, table and key, and what to do; its ``faults`` are all there are.
    """
    scene, faults = scene_and_faults(text, file, recorded)
    if faults:
        raise SceneError(*faults)
    return scene


def scene_and_faults(text: str, file: str, recorded: Scene | None = None) -> tuple[Scene, list[str]]:
    """Reads a scene with defaults in place of wrong values, and lists all faults; SceneError: it is no TOML.

    ``recorded`` as in `parse_scene`.
    """
    faults: list[str] = []
    whole = parse_toml(text, file, SceneError, faults)
    head = whole.table("scene") or whole.within({}, "[scene]")
    name, colliders = head.text("name"), head.text("colliders")
    has_source = bool(head.text("from"))
    for key in ("root", "surface"):
        if head.text(key) and not has_source:
            head.refuse(f"it has {key} and no from; name the file that the scene is read from")
    space = whole.table("space") or whole.within({}, "[space]")
    space_radius = space.number("radius_m", SPACE_RADIUS, above=0.0)
    head.done()
    space.done()
    bodies = tuple(_body(table) for table in whole.tables("body") or [])
    _check_bodies(bodies, whole)
    base = recorded if recorded is not None and not bodies else Scene(bodies=bodies)
    if recorded is not None and bodies and "group" not in whole:
        base = with_recorded_groups(base, recorded)
    if recorded is not None and has_source:
        declared = {body.id for body in bodies}
        bodies = (*(body for body in recorded.bodies if body.id not in declared), *bodies)
        base = Scene(bodies=bodies)
    groups = _groups(whole.tables("group") or [], base)
    known = replace(base, groups=(*base.groups, *groups))
    named = bodies_by_selector(known)
    pairs, ignore = whole.tables("pair"), whole.tables("ignore")
    effects = whole.tables("effect")
    scene = Scene(
        name=name,
        bodies=bodies,
        groups=groups,
        pairs=None if pairs is None else _selected_pairs(pairs, named),
        ignore=_selected_pairs(ignore or [], named),
        effects=None if effects is None else tuple(_effect(table, named) for table in effects),
        colliders=colliders,
        space_radius=space_radius,
        text=text,
        file=file,
    )
    whole.done()
    return scene, faults


def declares_bodies(text: str, file: str) -> bool:
    """Whether a scene declares bodies, itself or by ``from``; one that declares none adds to a recording's scene."""
    whole = parse_toml(text, file, SceneError, [])
    return "body" in whole or bool(named_source(text, file)["from"])


def named_source(text: str, file: str) -> dict[str, str]:
    """The file that a scene's bodies are read from (``from``), its ``root`` and its ``surface``; ``""``: not named."""
    head = parse_toml(text, file, SceneError, []).table("scene")
    return {key: "" if head is None else head.text(key) for key in ("from", "root", "surface")}


def recorded_bodies(scene: Scene, names: Sequence[str]) -> Scene:
    """A recording's scene with all tracks among its bodies, those that it does not declare too."""
    declared = {body.id for body in scene.bodies}
    return replace(scene, bodies=(*scene.bodies, *(SceneBody(name) for name in names if name not in declared)))


def with_recorded_groups(scene: Scene, recorded: Scene) -> Scene:
    """Returns a scene that declares bodies and no group with the groups of a recording, and their members as bodies."""
    if scene.groups or not recorded.groups:
        return scene
    declared = {body.id for body in scene.bodies}
    members = [member for group in recorded.groups for member in group.members if member not in declared]
    return replace(scene, bodies=(*scene.bodies, *map(SceneBody, members)), groups=recorded.groups, text="")


def added_scene(recorded: Scene, more: Scene) -> Scene:
    """A recording's scene and what a scene without bodies adds: its groups and ignored pairs, and what it declares
    of name, pairs, effects, colliders and space in place of the recording's.
    """
    return replace(
        recorded,
        name=more.name or recorded.name,
        groups=(*recorded.groups, *more.groups),
        pairs=recorded.pairs if more.pairs is None else more.pairs,
        ignore=tuple(dict.fromkeys([*recorded.ignore, *more.ignore])),
        effects=recorded.effects if more.effects is None else more.effects,
        colliders=more.colliders,
        space_radius=recorded.space_radius if more.space_radius == SPACE_RADIUS else more.space_radius,
        text="",
    )


def _groups(tables: list[TomlTable], base: Scene) -> tuple[SceneGroup, ...]:
    """The groups of a scene; ``base`` has the bodies that can be members, and groups that are there already."""
    names = [body.id for body in base.bodies]
    taken = dict.fromkeys(names, "a body") | {group.name: "a group" for group in base.groups}
    member_of, groups = base.group_of, list[SceneGroup]()
    for table in tables:
        name = table.text("name", None)
        table.location = f"{table.location} ({name!r})"
        if name in taken:
            table.refuse(f"{taken[name]} has that name; give another")
        members: dict[str, None] = {}
        for selector in table.texts("members"):
            selected = selected_bodies(base, names, selector)
            if not selected:
                table.refuse(f"no body is {selector!r}{nearest(selector, names)}")
            members |= dict.fromkeys(selected)
        doubly = [member for member in members if member in member_of]
        if doubly:
            table.refuse(f"{doubly[0]!r} is a member of {member_of[doubly[0]]!r}; a body has one group")
        if len(members) < 2:
            table.refuse("a group needs members, two bodies at least")
        table.done()
        taken[name] = "a group"
        member_of = {**dict.fromkeys(members, name), **member_of}
        groups.append(SceneGroup(name, tuple(members)))
    return tuple(groups)


def bodies_by_selector(scene: Scene) -> Selected:
    """The bodies of each selector."""
    selected: dict[str, list[str]] = {group.name: [*group.members] for group in scene.groups}
    for body in scene.bodies:
        if not body.id.startswith(TAG):
            selected[body.id] = [body.id]
        for tag in dict.fromkeys(body.tags):
            selected.setdefault(TAG + tag, []).append(body.id)
    return selected


def _body(table: TomlTable) -> SceneBody:
    name = table.text("id", None)
    table.location = f"{table.location} ({name!r})"
    shape = table.text("shape", among=SIZES)
    body = SceneBody(
        id=name,
        mesh=table.text("mesh"),
        node=table.text("node"),
        shape=shape,
        instrument=table.text("instrument"),
        size=_size(table, shape),
        scale=table.number("scale", 1.0, above=0.0),
        mesh_axes=table.text("mesh_axes"),
        group=table.text("group"),
        parent=table.text("parent"),
        offset=_pose(table.table("offset")) or Pose(),
        fixed=_pose(table.table("fixed")),
        tags=table.texts("tags"),
        proxy=table.flag("proxy"),
        extra=_extra(table),
    )
    sources = [key for key in ("mesh", "shape", "instrument") if getattr(body, key)]
    if len(sources) > 1:
        table.refuse(f"it has {' and '.join(sources)}; give one of them")
    if body.mesh_axes:
        _check_mesh_axes(table, body)
    if body.node and not body.mesh:
        table.refuse("it has node and no mesh; name the GLB that holds the node")
    if body.instrument:
        from sessions.glassware.catalogue import INSTRUMENTS, instrument_options

        if body.instrument not in INSTRUMENTS:
            table.refuse(f"no instrument {body.instrument!r}{nearest(body.instrument, INSTRUMENTS)}")
        elif "options" in body.extra:
            options = table.within(body.extra["options"], f"{table.location} options")
            options.done(instrument_options(body.instrument))
    table.done()
    return body


def _check_mesh_axes(table: TomlTable, body: SceneBody) -> None:
    """Refuse axes that nobody knows, and those of no mesh file."""
    if not body.mesh:
        table.refuse("it has mesh_axes and no mesh; name the mesh file")
    try:
        mesh_axes_matrix(body.mesh_axes, CONVENTIONS["canonical"])
    except SessionError as error:
        table.refuse(f"mesh_axes: {error}")


def _size(table: TomlTable, shape: str) -> dict[str, float]:
    if not shape:
        return {}
    if shape == "box":
        x, y, z = table.vector("size", (0.0, 0.0, 0.0))
        size = {"x": x, "y": y, "z": z}
    else:
        size = {name: table.number(name, 0.0) for name in SIZES[shape]}
    bad = [name for name, value in size.items() if value <= 0.0]
    if bad:
        expected = "size = [x, y, z]" if shape == "box" else " and ".join(SIZES[shape])
        table.refuse(f"a {shape} needs {expected} in metres, each above 0")
    return size


def _extra(table: TomlTable) -> dict[str, Any]:
    extra: dict[str, Any] = {}
    if "mass" in table:
        extra["mass"] = table.number("mass", 0.0, above=0.0)
    if "margin" in table:
        extra["margin"] = table.number("margin", 0.0, above=0.0)
    if "faces" in table:
        extra["faces"] = table.count("faces", DEFAULT_FACES, 4, MOST_FACES)
    for key in ("cavity", "options", "properties"):
        inner = table.table(key)
        if inner is not None:
            extra[key] = inner.rest()
    return extra


def _pose(table: TomlTable | None) -> Pose | None:
    if table is None:
        return None
    position = table.vector("position", (0.0, 0.0, 0.0))
    if "euler_deg" in table:
        if "quaternion_xyzw" in table:
            table.refuse("it has quaternion_xyzw and euler_deg; give one of them")
            table.vector("quaternion_xyzw", IDENTITY)
        angles = [math.radians(angle) for angle in table.vector("euler_deg", (0.0, 0.0, 0.0))]
        quaternion = tuple(quaternion_from_euler(angles, "xyz").tolist())
    else:
        quaternion = table.vector("quaternion_xyzw", IDENTITY)
    norm = math.hypot(*quaternion)
    if not abs(norm - 1.0) <= 1e-3:
        table.refuse(f"quaternion_xyzw {list(quaternion)} has norm {number(norm, digits=6)}, not 1")
    table.done()
    return Pose(cast(tuple[float, float, float], position), cast(tuple[float, float, float, float], quaternion))


def _check_bodies(bodies: tuple[SceneBody, ...], whole: TomlTable) -> None:
    parents = {body.id: body.parent for body in bodies}
    first: dict[str, int] = {}
    ends = {""}  # and what is known to lead there: a long chain of parents is walked once
    for row, body in enumerate(bodies, start=1):
        label = f"[[body]] {row} ({body.id!r})"
        if first.setdefault(body.id, row) != row:
            whole.refuse(f"{label}: the id is taken by [[body]] {first[body.id]}; ids must differ")
        if body.parent and body.parent not in parents:
            whole.refuse(f"{label}: no parent {body.parent!r}{nearest(body.parent, parents)}")
        chain, above = set[str](), body.parent
        while above not in ends and above not in chain:
            chain.add(above)
            above = parents.get(above, "")
        if above in ends:
            ends |= chain
        else:
            whole.refuse(f"{label}: its parents lead back to itself; a joint needs a first body")


def _selected_pairs(tables: list[TomlTable], bodies: Selected) -> tuple[tuple[str, str], ...]:
    chosen: dict[frozenset[str], tuple[str, str]] = {}
    pairs = 0
    for table in tables:
        first, second = _ends(table, bodies)
        if (pairs := pairs + len(first) * len(second)) > MOST_PAIRS:
            table.refuse(f"there are more than {MOST_PAIRS:,} pairs by now; name fewer")
        else:
            for pair in ((a, b) for a in first for b in second if a != b):
                chosen.setdefault(frozenset(pair), pair)
        table.done()
    return tuple(chosen.values())


def _ends(table: TomlTable, bodies: Selected) -> tuple[list[str], list[str]]:
    """The bodies of a table at both ends, of whatever is wrong none."""
    if "between" not in table and not table.done():
        return [], []
    ends = []
    for selector in table.texts("between", 2):
        if selector and selector not in bodies:
            table.refuse(f"no body is {selector!r}{nearest(selector, bodies)}")
        ends.append(bodies.get(selector, []))
    first, second = ends if len(ends) == 2 else ([], [])
    if first == second and len(first) == 1:
        table.refuse(f"{first[0]!r} is paired with itself; a pair needs two bodies")
    return first, second


def _effect(table: TomlTable, bodies: Selected) -> SceneEffect:
    kind = table.text("kind", None)
    table.location = f"{table.location} ({kind!r})"
    settings: dict[str, Any] = {}
    if "between" in table:
        settings["between"] = list(table.texts("between", 2))
        if len(settings["between"]) == 2:
            _ends(table.within(settings, table.location), bodies)
    settings.update(table.rest())
    return SceneEffect(kind, settings)


def scene_to_toml(scene: Scene) -> str:
    """The scene as TOML; read again it is the same scene, and the same scene gives the same text."""
    lines = [f"{key} = []" for key, value in (("effect", scene.effects), ("pair", scene.pairs)) if value == ()]
    head = [f"{key} = {value_text(text)}" for key in ("name", "colliders") if (text := getattr(scene, key))]
    lines += ["[scene]", *head] if head else []
    lines += ["[space]", f"radius_m = {scene.space_radius!r}"] if scene.space_radius != SPACE_RADIUS else []
    tables = [("body", body_keys(body)) for body in scene.bodies]
    tables += [("group", {"name": group.name, "members": group.members}) for group in scene.groups]
    tables += [("pair", {"between": pair}) for pair in scene.pairs or ()]
    tables += [("ignore", {"between": pair}) for pair in scene.ignore]
    tables += [("effect", {"kind": effect.kind, **effect.settings}) for effect in scene.effects or ()]
    for kind, entries in tables:
        lines += table_lines(kind, entries)
    return "\n".join(lines).lstrip("\n") + "\n"


def table_lines(kind: str, entries: Mapping[str, Any]) -> list[str]:
    """``[[kind]]`` and its keys, after an empty line."""
    return ["", f"[[{kind}]]", *(f"{key} = {value_text(value)}" for key, value in entries.items())]


def body_keys(body: SceneBody) -> dict[str, Any]:
    """The keys of a body in a scene file, without those that have their default."""
    keys: dict[str, Any] = {"id": body.id}
    plain = SceneBody(id=body.id)
    for key in ("mesh", "node", "shape", "instrument", "scale", "mesh_axes", "group", "parent", "tags", "proxy"):
        if getattr(body, key) != getattr(plain, key):
            keys[key] = getattr(body, key)
    keys.update({"size": [body.size[axis] for axis in "xyz"]} if body.shape == "box" else body.size)
    for key in ("offset", "fixed"):
        pose = getattr(body, key)
        if pose != getattr(plain, key):
            keys[key] = {"position": list(pose.position), "quaternion_xyzw": list(pose.quaternion_xyzw)}
    return {**keys, **{key: body.extra[key] for key in EXTRA_KEYS if key in body.extra}}


def value_text(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # TOML escapes DEL too
    if isinstance(value, dict):
        return "{" + ", ".join(f"{value_text(key)} = {value_text(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(value_text(item) for item in value) + "]"
    return repr(value) if is_number(value) else str(value)
