"""``examine``: finds everything wrong with a recording, a scene or a mesh; no fault ends the search."""

import hashlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from sessions.doctor.finding import Finding, Severity, Span, in_order
from sessions.doctor.meshes import all_mesh_findings, mesh_findings
from sessions.doctor.pose_pass import PosePass, look_through
from sessions.doctor.scale import table_findings
from sessions.doctor.session_findings import examine_session, frame_findings, scene_findings
from sessions.doctor.structure import is_mcap, structure_findings
from sessions.doctor.tolerant_frames import Noted, TolerantFrames
from sessions.errors import SessionError, SessionFileError
from sessions.mcap_format.mcap_file import McapFile
from sessions.mcap_format.metadata import BODIES_RECORD, SESSION_RECORD, mesh_file, metadata_of, migrated, names_of
from sessions.mcap_format.schemas import PROFILE_FAMILY, TF, WORLD, channel_spec
from sessions.mcap_format.writer import SCENE_FILE
from sessions.model.scene import Scene
from sessions.model.session import Session

MESH_FILES: Final = (".glb", ".obj", ".stl", ".ply", ".off")


def examine(recording: str | Path | Session) -> list[Finding]:
    """Everything that is wrong with a recording, or odd about it, the worst first.

    ``recording``: a session file, a mesh file (GLB, OBJ, STL, PLY, OFF), a scene (TOML), or a session in memory.

    Raises ``SessionFileError``: the file is missing or may not be read. Faults *in* the file become findings.
    """
    if isinstance(recording, Session):
        return in_order([*examine_session(recording)])
    path = Path(recording)
    try:
        size = path.stat().st_size
        kind = path.suffix.lower()
        if kind in MESH_FILES:
            return in_order([*_mesh_file(path)])
        if kind == ".toml":
            return in_order([*_scene_file(path)])
        if is_mcap(path):
            return in_order([*_session_file(path)])
    except OSError as error:
        raise SessionFileError(
            f"{path} cannot be read ({error.strerror or error}); check the path and who may read it"
        ) from None
    what = "it is empty" if not size else "it does not begin as an MCAP file does"
    return [Finding("not-mcap", Severity.ERROR, what)]


def _mesh_file(path: Path) -> Iterator[Finding]:
    from sessions.meshes.mesh_files import load_mesh

    try:
        mesh = load_mesh(path)
    except SessionError as error:
        code = "mesh-empty" if "no triangle" in str(error) or "is empty" in str(error) else "mesh-unreadable"
        yield Finding(code, Severity.ERROR, str(error), path.stem)
        return
    yield from mesh_findings(path.stem, mesh)


def _scene_file(path: Path) -> Iterator[Finding]:
    from sessions.scene_files.scene_meshes import scene_meshes
    from sessions.scene_files.scene_toml import read_scene

    try:
        scene = read_scene(path)
        meshes = scene_meshes(scene, path.parent)
    except SessionError as error:
        yield Finding("bad-scene", Severity.ERROR, str(error))
        return
    yield from all_mesh_findings(meshes)
    for finding in scene_findings(scene, [body.id for body in scene.bodies if body.fixed is None], [*meshes]):
        if finding.code != "no-mesh":
            yield finding


def _session_file(path: Path) -> Iterator[Finding]:
    try:
        file = McapFile(path)
    except SessionFileError as error:
        yield Finding("unreadable", Severity.ERROR, str(error))
        return
    yield from structure_findings(file)
    names: tuple[str, ...] = ()
    hashes: dict[str, str] = {}
    metadata: dict[str, str] = {}
    own = file.catalogue.profile.startswith(PROFILE_FAMILY)
    if own:
        try:
            record = migrated(file.catalogue.metadata_record(SESSION_RECORD) or {}, file.catalogue.profile)
            metadata, hashes = metadata_of(record)
        except SessionFileError as error:
            yield Finding("unknown-version", Severity.ERROR, str(error))
        try:
            names = names_of(file.catalogue.metadata_record(BODIES_RECORD))
        except SessionFileError as error:
            yield Finding("unreadable", Severity.ERROR, str(error))
    frames = TolerantFrames(file, names)
    scene, scene_faults = _scene(file)
    looked = look_through(frames.blocks(), scene.space_radius)
    yield from scene_faults
    if not len(looked.stamp_ns):
        foreign = _foreign(file)
        frames.noted.unread *= not foreign
        yield Finding("no-poses", Severity.ERROR, foreign or "it holds no pose that can be read")
    yield from _noted(frames.noted, looked, names if own else looked.names, file)
    yield from frame_findings(looked, scene, metadata)
    meshes = []
    for name, expected in hashes.items():
        meshes.append(name)
        yield from _attached_mesh(file, name, expected, scene)
    yield from scene_findings(scene, looked.names, meshes)


def _foreign(file: McapFile) -> str:
    """What the messages on the topic of poses are, where they are those of another program."""
    spec = channel_spec(TF)
    found = {one.schema or one.encoding for one in file.catalogue.channels.values() if one.topic == TF}
    other = ", ".join(sorted(found - {spec.schema}))
    return f"{TF} carries {other}, not {spec.schema}" if other else ""


def _scene(file: McapFile) -> tuple[Scene, list[Finding]]:
    from sessions.scene_files.scene_toml import parse_scene

    try:
        data = file.attachment(SCENE_FILE)
        return (Scene() if data is None else parse_scene(data.decode("utf-8", errors="replace"), SCENE_FILE)), []
    except SessionError as error:
        return Scene(), [Finding("bad-scene", Severity.ERROR, str(error))]


def _attached_mesh(file: McapFile, name: str, expected: str, scene: Scene) -> Iterator[Finding]:
    from sessions.meshes.mesh_files import mesh_from_bytes

    try:
        data = file.attachment(mesh_file(name))
        if data is None:
            yield Finding("mesh-unreadable", Severity.ERROR, "the file lists its hash but does not hold it", name)
            return
        found = hashlib.sha256(data).hexdigest()
        if found != expected:
            message = f"its SHA-256 is {found[:12]}..., recorded was {expected[:12]}..."
            yield Finding("mesh-hash", Severity.ERROR, message, name)
        mesh = mesh_from_bytes(data, "glb")
    except SessionError as error:
        code = "mesh-empty" if "no triangle" in str(error) else "mesh-unreadable"
        yield Finding(code, Severity.ERROR, str(error), name)
        return
    yield from mesh_findings(name, mesh)
    yield from table_findings({name: mesh}, scene)


def _noted(noted: Noted, looked: PosePass, listed: tuple[str, ...], file: McapFile) -> Iterator[Finding]:
    """What a strict reader would have refused."""
    zero = int(looked.stamp_ns[0]) if len(looked.stamp_ns) else 0
    for code, regions in (("damaged-chunk", noted.unpacked), ("bad-message", noted.unread)):
        for region, why in regions:
            message = why.removeprefix(f"{file.catalogue.path}: ").split(";")[0]
            if region.start:
                span = Span(region.first_ns, region.last_ns, zero)
                yield span.finding(code, Severity.ERROR, message, count=region.size)
            else:
                yield Finding(code, Severity.ERROR, message, count=region.size)
    yield from _unknown_frames(noted, listed, zero)
    for child, count in noted.doubled.items():
        message = f"{count} frames hold two samples of it; the first was taken"
        yield Finding("duplicate-stamps", Severity.WARNING, message, child, count=count)


def _unknown_frames(noted: Noted, listed: tuple[str, ...], zero: int) -> Iterator[Finding]:
    # The frame that most samples are given in; the world where any is.
    count = Counter[str]()
    for (parent, _), seen in noted.frames.items():
        count[parent] += seen.count
    usual = WORLD if WORLD in count or not count else count.most_common(1)[0][0]
    for (parent, child), seen in noted.frames.items():
        if parent == usual and child in listed:
            continue
        message = f"{seen.count} samples of a body that the file does not list"
        if parent != usual:
            message = f"{seen.count} samples are given in frame {parent!r}, the others in {usual!r}"
        span = Span(seen.first_ns, seen.last_ns, zero)
        yield span.finding("unknown-frame", Severity.ERROR, message, child, seen.count)
