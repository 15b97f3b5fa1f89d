"""The room and its moments: whatever a recording says at a cursor is what the tables of the result say of that time."""

import numpy as np
import pytest
from support.small_worlds import jumping

from cdcore import Verdict
from cdcore.bounding.bounding_sphere import sphere_best
from replay.auditing.fault import Fault, FaultKind
from replay.auditing.outcome import Outcome
from replay.engine import compute
from replay.show.camera import CLOSE_UP_M, points_in_world
from replay.show.drawn_mesh import face_normals, spans_hollow
from replay.show.palette import FREE, LATE, MISSED, TRUE_CONTACT, WITHIN_TOLERANCE, albedo, see_through, tags_of
from replay.show.rerun_log import scene
from replay.show.rerun_log.close_up import LARGEST_BALL_M, close_up_eyes, detectors_with_solids, sharp_edges
from replay.show.rerun_log.moments import FALSE, LISTS_ENTITY, MISS, key_moments, leading_moment, read_bookmarks
from replay.show.rerun_log.recording_file import RecordingClock, pack_colours
from replay.show.rerun_log.scene import FACE_OFFSET_M, LARGE_FACE_M2, drawn_contacts, face_areas
from replay.words import length

COLOURS = {Outcome.MISSED: MISSED, Outcome.WITHIN_TOLERANCE: WITHIN_TOLERANCE}


@pytest.fixture(scope="module")
def runs(demo, taps, passed):
    """Misses and false contacts of a fixed rate, of hulls, between frames, and of a reference that lists no faces."""
    without_faces = compute(
        jumping([3, 3, 3, 0.9, 3, 3, 3, 3]), detectors="slow=discrete[rate_hz=20]", oracle="continuous"
    )
    return {
        "slow rate": demo,
        "hulls": taps("hull", "collider", shape="hull"),
        "between frames": passed,
        "reference without faces": without_faces,
    }


def nanoseconds(run, frame, later=0):
    """Nanoseconds of a frame, and ``later`` after it, since the session began."""
    return int(run.assembly.stamp_ns[frame] - run.assembly.stamp_ns[0]) + later


def faults(run):
    """Yields for each fault of the tables: (detector, kind, number), itself, the moment of most to see, its size.

    The size is the depth, or metres where that is unknown.
    """
    for label, misses in run.misses.items():
        yield from (
            ((label, MISS, miss.number), miss, miss.moment, miss.metres if np.isnan(miss.depth) else miss.depth)
            for miss in misses
        )
        yield from (
            ((label, FALSE, false.number), false, false.moment, false.metres) for false in run.false.get(label, ())
        )


def fault_lines_and_eyes(run, read):
    """Every fault has a line, a number that leads there, a dot, and an eye and words before it."""
    bookmarks, pair_name = read_bookmarks(read.path), run.assembly.pair_name
    lists = [path[1:] for path in read.entities if path.startswith(f"/{LISTS_ENTITY}")]
    lines = {ns: " ".join(text[0].split()) for path in lists for ns, _, text in read.column(path, "TextLog:text")}
    yield sorted(lines), sorted(bookmark.session_ns for bookmark in bookmarks)
    existing = {(bookmark.label, bookmark.kind, bookmark.number): bookmark.session_ns for bookmark in bookmarks}
    assert {name for name in existing if name[0]} == {name for name, *_ in faults(run)}
    for name, fault, printed, size in faults(run):
        ns, written = existing[name], f" {length(size)} "
        assert 0 <= ns - nanoseconds(run, *printed) < 10, "of one frame each has a nanosecond of its own"
        texts_of_line = [
            f"{ns / 1e9:.3f} s",
            name[0],
            fault.name.split()[0],
            str(name[2]),
            fault.cause,
            pair_name(fault.pair),
        ]
        assert f"{lines[ns]} ".startswith(f"{' '.join(texts_of_line)} ")
        assert not size > 0 or written in lines[ns]
        (output,) = read.at_ns("world/focus/words", "Points3D:labels", ns)
        (eye,) = read.at_ns("world/focus/eye", "Transform3D:translation", ns)
        if name[1] == MISS:
            extent = "" if fault.kind == FaultKind.NEVER_REPORTED else "a part of "
            assert output == f"{name[0]} misses {extent}this contact"
            yield np.linalg.norm(np.subtract(eye, fault.point)), CLOSE_UP_M
        elif np.isfinite(size):
            assert length(size) in output
            yield np.shape(read.at_ns("world/focus/lines", "LineStrips3D:strips", ns)), (4, 2, 3)
    ((_, _, dots),) = read.column("world/focus/pins", "Points3D:positions")
    yield np.sort(dots, axis=0), np.sort([fault.point for _, fault, *_ in faults(run)], axis=0)


def fault_labels(run, read):
    """Words and lines stand there while a fault lasts, at no other time; where two overlap, one may end the other's."""
    lasting = np.zeros(len(run.assembly.motion))
    segments = [slice(min(fault.first, frame), fault.last + 1) for _, fault, (frame, _), _ in faults(run)]
    for segment in segments:
        lasting[segment] += 1
    sure = np.ones(len(lasting), dtype=bool)
    for segment in segments:
        sure[segment] &= lasting[segment].max() == 1
    for name, component in (("words", "Points3D:labels"), ("lines", "LineStrips3D:strips")):
        recorded = [len(read.at(f"world/focus/{name}", component, frame)) > 0 for frame in range(len(lasting))]
        yield np.array(recorded)[sure], lasting[sure]


def contact_curves(run, read):
    """The sections of the reference: red where missed, pink where a part was missed, blue where found."""
    detection, (label,) = run.detections[run.oracle], run.comparisons
    path = f"world/contacts/{run.oracle}"
    drawn, outcome = f"/{path}" in read.entities, run.comparisons[label].outcome
    yield drawn, detection.section_source is not None
    for frame in range(len(outcome) if drawn else 0):
        strips, colours = [np.zeros((0, 2, 3))], []
        for pair in np.flatnonzero(detection.verdict[frame] == Verdict.CONTACT).tolist():
            strips.append(detection.section(frame, pair))
            partial_misses = [
                miss for miss in run.misses[label] if miss.pair == pair and miss.kind != FaultKind.NEVER_REPORTED
            ]
            late = any(miss.first <= frame <= miss.last for miss in partial_misses)
            colour_of_outcome = COLOURS | ({Outcome.MISSED: LATE} if late else {})
            colours += [colour_of_outcome.get(outcome[frame, pair], TRUE_CONTACT)] * len(strips[-1])
        yield np.reshape(read.at(path, "LineStrips3D:strips", frame), (-1, 2, 3)), np.concatenate(strips)
        yield read.at(path, "LineStrips3D:colors", frame), pack_colours(colours)


def missed_faces(run, read):
    """Faces that met unseen while they did, at the deepest moment where none are listed."""
    assembly, oracle, (misses,) = run.assembly, run.detections[run.oracle], run.misses.values()
    painted, times = {}, {nanoseconds(run, frame) for frame in range(len(assembly.motion))}
    for miss in misses:
        if oracle.face_sets is not None:
            segment = range(miss.first, miss.last + 1)
            met = {nanoseconds(run, frame): oracle.faces(frame, miss.pair) for frame in segment}
        else:
            touch = miss.evidence.touch
            met = {nanoseconds(run, *miss.moment): miss.evidence.faces if touch is None else [touch.faces]}
            times |= {ns - early for ns in met for early in (0, 1)}
        kind = "missed" if miss.kind == FaultKind.NEVER_REPORTED else "late"
        for ns, faces in met.items():
            sides = dict(zip(assembly.pairs[miss.pair].tolist(), np.transpose(faces), strict=True))
            small = {body: k[face_areas(assembly.bodies[body].mesh, k) <= LARGE_FACE_M2] for body, k in sides.items()}
            for body, side in (small if any(map(len, small.values())) else sides).items():
                key = body, "missed" if miss.kind == FaultKind.NEVER_REPORTED else "late"
                painted.setdefault(key, {}).setdefault(ns, set()).update(side.tolist())
    for (body, kind), faces_at in painted.items():
        path, mesh = f"world/{assembly.names[body]}/{kind}_faces", assembly.bodies[body].mesh
        for ns in times:
            recorded = read.at_ns(path, "Mesh3D:vertex_positions", ns)
            faces = mesh.triangles[sorted(faces_at.get(ns, ()))]
            yield np.reshape(recorded, (-1, 3, 3)), faces + FACE_OFFSET_M * face_normals(faces)[1][:, None]


def hulls_around_bodies(run, read):
    """Edges and lid of the hull that a body lies in, all its faces where it has none, while a false contact lasts."""
    names, count = run.assembly.names, len(run.assembly.motion)
    for label in detectors_with_solids(run):
        lasts = {}
        for _, false, *_ in faults(run):
            lasts.setdefault(false.evidence.hollow, np.zeros(count, dtype=bool))[false.first : false.last + 1] = True
        for hollow, frames in lasts.items():
            hull = run.detectors[label].colliders[names.index(hollow)].mesh
            edges = sharp_edges(hull)
            lid = spans_hollow(hull, run.assembly.bodies[names.index(hollow)].mesh)
            drawn_faces = hull.triangles[lid] if lid.any() else hull.triangles
            for k in range(count):
                recorded = read.at(f"world/{hollow}/solid_of_{label}", "LineStrips3D:strips", k)
                yield np.reshape(recorded, (-1, 2, 3)), edges if frames[k] else edges[:0]
                faces = read.at(f"world/{hollow}/solid_of_{label}/faces", "Mesh3D:vertex_positions", k)
                yield np.reshape(faces, (-1, 3, 3)), drawn_faces if frames[k] else drawn_faces[:0]


def body_colours(run, read):
    """A body in a hull that touches nothing is white; what hides a moment is faint, the larger of its pair too."""
    assembly, balls = run.assembly, [sphere_best(body.mesh) for body in run.assembly.bodies]
    moments = key_moments(run)
    for (frame, later), eye in close_up_eyes(run, moments, balls).items():
        moment = moments[frame, later]
        ns = nanoseconds(run, frame, later)
        sight = np.linspace(eye.position, eye.target, 2000)
        for body, name in enumerate(assembly.names):
            pair, tags = assembly.pairs[moment.pair].tolist(), tags_of(name, run.session.scene)
            centre = points_in_world(assembly.motion, frame, body, balls[body].centre[None])
            near = np.linalg.norm(sight - centre, axis=1).min() <= balls[body].radius <= LARGEST_BALL_M
            hides = near if body not in pair else body == max(pair, key=lambda index: (balls[index].radius, index))
            colour = see_through(tags) if hides else albedo(tags)
            is_fault = isinstance(moment, Fault)
            hollow = moment.evidence.hollow if is_fault else ""
            solids = is_fault and moment.detector in detectors_with_solids(run)
            if solids and hollow and body in pair and name != hollow:
                colour = FREE
            (recorded,) = read.at_ns(f"world/{name}/mesh", "Mesh3D:albedo_factor", ns)
            yield recorded, pack_colours([(*colour[:3], colour[3] * assembly.motion.valid[frame, body])])[0]


RUN_NAMES = ("slow rate", "hulls", "between frames", "reference without faces")


def require_equal(compared):
    """Asserts of each pair, recorded and expected, that both have the same shape and values to a micrometre."""
    compared = [*compared]
    assert compared
    for recorded, expected in compared:
        assert np.shape(recorded) == np.shape(expected)
        assert np.allclose(recorded, expected, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("run_name", RUN_NAMES)
def test_every_fault_has_line_bookmark_dot_and_close_up(run_name, runs, drawn):
    """Faults are those of the tables of a run. In the recording each has a line in a list, with its size and bodies.

    Its bookmark is at the frame where most is to be seen; there the eye and a text stand before it, and a dot at its
    point. ``fault_lines_and_eyes`` yields what is recorded and what the tables say.
    """
    require_equal(fault_lines_and_eyes(runs[run_name], drawn(runs[run_name])))


@pytest.mark.parametrize("run_name", RUN_NAMES)
def test_texts_and_lines_of_a_fault_last_as_it(run_name, runs, drawn):
    """In each frame the recording has texts and lines of a close-up exactly if a fault of the tables lasts then.

    Frames in which two faults overlap are left out. ``fault_labels`` yields both as a truth value a frame.
    """
    require_equal(fault_labels(runs[run_name], drawn(runs[run_name])))


@pytest.mark.parametrize("run_name", RUN_NAMES)
def test_contact_curves_are_those_of_the_reference_by_outcome(run_name, runs, drawn):
    """Curves where surfaces meet, in each frame: those of the reference, red if missed, pink if in a part, else blue.

    A reference that lists no curves has none drawn. ``contact_curves`` yields segments and colours.
    """
    require_equal(contact_curves(runs[run_name], drawn(runs[run_name])))


@pytest.mark.parametrize("run_name", [name for name in RUN_NAMES if name != "hulls"])
def test_faces_of_missed_contacts_are_painted_while_missed(run_name, runs, drawn):
    """In each frame the faces that meet, by the reference, in a contact missed then are drawn on both bodies.

    They lie a little before the surface. ``missed_faces`` yields their corners.
    """
    require_equal(missed_faces(runs[run_name], drawn(runs[run_name])))


def test_run_without_misses_paints_no_missed_faces(runs, drawn):
    """A detector of convex hulls misses no contact, since hulls contain their bodies.

    No face is drawn as missed or late.
    """
    run = runs["hulls"]
    assert [miss for misses in run.misses.values() for miss in misses] == []
    assert [path for path in drawn(run).entities if path.endswith(("missed_faces", "late_faces"))] == []


def test_hull_is_drawn_while_its_false_contact_lasts(runs, drawn):
    """The beaker's hull fills its hollow: while the rod in there is falsely reported, edges and lid of it are drawn.

    A hull without a lid is drawn with all faces. ``hulls_around_bodies`` yields edges and faces, a frame each.
    """
    require_equal(hulls_around_bodies(runs["hulls"], drawn(runs["hulls"])))


@pytest.mark.parametrize("run_name", [name for name in RUN_NAMES if name != "hulls"])
def test_detectors_of_meshes_have_no_solids_drawn(run_name, runs, drawn):
    """A detector that decides about the meshes themselves has no colliders of its own."""
    assert [path for path in drawn(runs[run_name]).entities if "solid_of_" in path] == []


@pytest.mark.parametrize("run_name", RUN_NAMES)
def test_hiding_bodies_are_faint_and_free_bodies_white(run_name, runs, drawn):
    """At each moment of a run, what stands between eye and moment is see-through, and the larger body of its pair.

    In a false contact of a hull the body in the hollow, which touches nothing, is white. ``body_colours`` yields one
    colour a body and moment.
    """
    require_equal(body_colours(runs[run_name], drawn(runs[run_name])))


def test_picture_opens_with_bodies_posed_as_in_the_headline(runs, drawn):
    """A viewer opens just before the first frame; there every body is where it was in the fault of the headline."""
    run = runs["hulls"]
    picture = drawn(run)
    headline_ns = nanoseconds(run, *leading_moment(run, key_moments(run)))
    opening_ns = nanoseconds(run, frame=0) - 1
    assert run.assembly.names
    for name in run.assembly.names:
        position_at_opening = picture.at_ns(f"world/{name}", "Transform3D:translation", opening_ns)
        position_in_headline = picture.at_ns(f"world/{name}", "Transform3D:translation", headline_ns)
        assert np.array_equal(position_at_opening, position_in_headline)


def test_contacts_within_the_budget_are_all_drawn(demo):
    """A rod taps a beaker in 90 frames: far fewer contacts than the most that are drawn, 20,000."""
    face_sets = demo.detections[demo.oracle].face_sets
    assert len(face_sets.frame) > 0
    drawn_numbers, _frames = drawn_contacts(RecordingClock.of(demo.assembly), face_sets)
    assert drawn_numbers.tolist() == [*range(len(face_sets.frame))]


def test_beyond_the_budget_frames_are_strided_but_moments_stay(demo, monkeypatch):
    """The limit is lowered to 20 contacts, of which the run of taps has more: some frames are left out.

    Frames of all misses stay; contacts are drawn in frames that stay only.
    """
    face_sets = demo.detections[demo.oracle].face_sets
    moments = {miss.frame for miss in demo.misses["22.5Hz"]}
    monkeypatch.setattr(scene, "MOST_DRAWN_CONTACTS", 20)
    drawn_numbers, frames = drawn_contacts(RecordingClock.of(demo.assembly, [*moments]), face_sets)
    assert moments
    assert moments <= set(frames.tolist())
    assert len(drawn_numbers) < len(face_sets.frame)
    assert np.isin(face_sets.frame[drawn_numbers], frames).all()
