"""``examine``: finds everything wrong with a recording, a scene or a mesh; no fault ends the search."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sessions.doctor.finding import Finding, Span, in_order
from sessions.doctor.meshes import all_mesh_findings, mesh_findings
from sessions.doctor.pose_pass import PosePass, run_pose_pass
from sessions.doctor.session_findings import examine_session, scene_findings
from sessions.errors import MeshFileError, SceneError, SessionFileError
from sessions.input_files import open_input
from sessions.mcap import reader
from sessions.mcap.container import Region
from sessions.mcap.frame_codec import Appearance, FrameDecoder
from sessions.mcap.reader import McapFile
from sessions.mcap.refusals import brief
from sessions.mcap.schemas import WORLD
from sessions.mcap.unpacking import read_region
from sessions.mcap.writer import SCENE_FILE
from sessions.mesh_data import MeshData
from sessions.model.scene import Scene
from sessions.model.session import Frames, Session

if TYPE_CHECKING:
    from sessions.scene_files.scene_meshes import Planned

MESH_FILES: Final = (".glb", ".obj", ".stl", ".ply", ".off")


def examine(
    recording: str | Path | Session, *, scene: str | Path | None = None, planned: "Planned" = lambda *_: ()
) -> list[Finding]:
    """Everything that is wrong with a recording, or odd about it, the worst first.

    ``recording``: a session file, a mesh file (GLB, OBJ, STL, PLY, OFF), a scene (TOML), or a session in memory;
    ``scene``: a scene file in place of the session's own; ``planned`` judges effects, which `sessions` does not know.

    Raises ``SessionFileError``: the file is missing or may not be read. Faults *in* the file become findings.
    """
    if isinstance(recording, Session):
        replaced = recording
        if scene is not None:
            from sessions.scene_files.scene_meshes import with_scene

            replaced = with_scene(recording, scene)
        return in_order([*examine_session(replaced), *_bad_scene(planned(replaced.scene))])
    path = Path(recording)
    kind = path.suffix.lower()
    with open_input(path, "file", SessionFileError):
        if kind in MESH_FILES:
            return in_order([*_mesh_file(path)])
        if kind == ".toml":
            return in_order([*_scene_file(path, planned)])
        return in_order([*_session_file(path, scene, planned)])


def _mesh_file(path: Path) -> Iterator[Finding]:
    from sessions.meshes.mesh_files import load_mesh

    try:
        mesh = load_mesh(path)
    except MeshFileError as error:
        yield Finding(error.code, str(error), path.stem)
        return
    yield from mesh_findings(path.stem, mesh)


def _bad_scene(faults: Iterable[str]) -> Iterator[Finding]:
    return (Finding("bad-scene", fault) for fault in faults)


Checked = tuple[Scene, dict[str, MeshData], list[str]]


def _checked_scene(path: Path, planned: "Planned") -> Checked:
    from sessions.input_files import read_text
    from sessions.scene_files.scene_meshes import checked_scene

    try:
        return checked_scene(read_text(path, "scene", SceneError), path.name, planned, path.parent)
    except SceneError as error:
        return Scene(), {}, [*error.faults]


def _scene_of_file(path: Path, planned: "Planned", attached: Callable[[], Checked], names: Sequence[str]) -> Checked:
    """The scene of a file in place of the attached one, or added to it if it declares no body."""
    from sessions.input_files import read_text
    from sessions.scene_files.scene_meshes import checked_scene
    from sessions.scene_files.scene_toml import declares_bodies, recorded_bodies

    try:
        text = read_text(path, "scene", SceneError)
        if declares_bodies(text, path.name):
            return checked_scene(text, path.name, planned, path.parent)
        return checked_scene(text, path.name, planned, recorded=recorded_bodies(attached()[0], names))
    except SceneError as error:
        return Scene(), {}, [*error.faults]


def _scene_file(path: Path, planned: "Planned") -> Iterator[Finding]:
    scene, meshes, faults = _checked_scene(path, planned)
    yield from _bad_scene(faults)
    yield from all_mesh_findings(meshes)
    for finding in scene_findings(scene, [body.id for body in scene.bodies if body.fixed is None], [*meshes]):
        if finding.code != "no-mesh":
            yield finding


def refusal(error: SessionFileError, body: str = "") -> Finding:
    """A refusal of a file as a finding, without its file and its cure."""
    return Finding(error.code, brief(error), body)


def _session_file(path: Path, replaced: str | Path | None, planned: "Planned") -> Iterator[Finding]:
    try:
        file = McapFile(path, strict=False)
    except SessionFileError as error:
        yield refusal(error)
        return
    file.attempt(partial(reader.check_version, file), None)
    names = file.attempt(partial(reader.listed_names, file), ()) if file.own else ()
    nothing: Checked = (Scene(), {}, [])
    attached = partial(file.attempt, partial(_attached_scene, file, planned), nothing)
    scene, declared, faults = (
        attached() if replaced is None else _scene_of_file(Path(replaced), planned, attached, names)
    )
    session = reader.session_of(file, names, scene)
    reader.load_streams(session)
    decoder, damaged = FrameDecoder(file.catalogue, names, strict=False), Damaged()
    pose_pass = run_pose_pass(_readable(file, decoder, damaged), scene.space_radius)
    known = len(file.refused)
    file.attempt(file.catalogue.check_pose_channels, None)
    if len(file.refused) > known:
        damaged.unread.clear()
    elif not len(pose_pass.stamp_ns):
        yield Finding("no-poses", "it holds no pose that can be read")
    yield from _bad_scene(faults)
    yield from _file_findings(file)
    yield from _decoding_findings(decoder, damaged, pose_pass, names if file.own else pose_pass.names)
    yield from examine_session(replace(session, meshes={**session.meshes, **declared}), pose_pass)


@dataclass
class Damaged:
    """Regions whose bytes are damaged, and those whose messages are not what their schema says; and why."""

    unpacked: list[tuple[Region, SessionFileError]] = field(default_factory=list)
    unread: list[tuple[Region, SessionFileError]] = field(default_factory=list)


def _readable(file: McapFile, decoder: FrameDecoder, damaged: Damaged) -> Iterator[Frames]:
    """All frames in file order; every region of the file is unpacked, also where it holds no poses."""
    with file.path.open("rb") as stream:
        for region in file.catalogue.regions:
            try:
                table = read_region(stream, region, file.catalogue)
            except SessionFileError as error:
                damaged.unpacked.append((region, error))
                continue
            try:
                yield from decoder.decode(table)
            except SessionFileError as error:
                damaged.unread.append((region, error))


def _file_findings(file: McapFile) -> Iterator[Finding]:
    """Everything about the file itself, once all of it was read."""
    catalogue = file.catalogue
    if catalogue.tear is not None:
        message = f"it ends or breaks off at byte {catalogue.tear} of {catalogue.size}, without an index"
        code = "no-poses" if catalogue.is_import else "torn"
        yield Finding(code, message, count=catalogue.size - catalogue.tear)
    # A record within a chunk is met each time that the chunk is unpacked.
    refused = [*((fault.error, fault.name) for fault in catalogue.faults), *file.refused]
    yield from dict.fromkeys(refusal(error, name) for error, name in refused)


def _attached_scene(file: McapFile, planned: "Planned") -> Checked:
    """The scene that a file carries."""
    from sessions.scene_files.scene_meshes import checked_scene

    data = file.attachment(SCENE_FILE)
    return (Scene(), {}, []) if data is None else checked_scene(data.decode(errors="replace"), SCENE_FILE, planned)


def _decoding_findings(
    decoder: FrameDecoder, damaged: Damaged, pose_pass: PosePass, listed: tuple[str, ...]
) -> Iterator[Finding]:
    """Findings of what a strict reader refuses."""
    zero = int(pose_pass.stamp_ns[0]) if len(pose_pass.stamp_ns) else 0
    for region, error in (*damaged.unpacked, *damaged.unread):
        finding = refusal(error)
        if region.is_chunk:
            span = Span(region.first_ns, region.last_ns, zero)
            yield span.finding(finding.code, finding.message, count=region.size)
        else:
            yield replace(finding, count=region.size)
    yield from _unknown_frames(decoder.met, listed, zero)
    for child, count in decoder.doubled.items():
        message = f"{count} frames hold two samples of it; the first was taken"
        yield Finding("duplicate-stamps", message, child, count=count)


def _unknown_frames(met: Mapping[tuple[str, str], Appearance], listed: tuple[str, ...], zero: int) -> Iterator[Finding]:
    # The frame that most samples are given in; the world where any is.
    count = Counter[str]()
    for (parent, _), appearance in met.items():
        count[parent] += appearance.count
    usual = WORLD if WORLD in count or not count else count.most_common(1)[0][0]
    for (parent, child), appearance in met.items():
        if parent == usual and child in listed:
            continue
        message = f"{appearance.count} samples of a body that the file does not list"
        if parent != usual:
            message = f"{appearance.count} samples are given in frame {parent!r}, the others in {usual!r}"
        span = Span(appearance.first_ns, appearance.last_ns, zero)
        yield span.finding("unknown-frame", message, child, appearance.count)
