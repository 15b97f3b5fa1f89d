import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from hypothesis import given
from hypothesis import strategies as st

from sessions.mcap_format.transform_template import stamp_overflows, transform_template

doubles = st.floats(width=64)


@st.composite
def transforms(draw):
    one = FrameTransform(parent_frame_id=draw(st.text(max_size=3)), child_frame_id=draw(st.text(max_size=3)))
    if draw(st.booleans()):
        one.timestamp.seconds = draw(st.integers(-(2**33), 2**33))
        one.timestamp.nanos = draw(st.integers(0, 999_999_999))
    for part, axes in ((one.translation, "xyz"), (one.rotation, "xyzw")):
        for axis in axes:
            setattr(part, axis, draw(doubles))
    return one


def rows(data):
    return np.frombuffer(data, dtype=np.uint8)[None]


@given(transforms())
def test_a_template_reads_its_own_example_like_the_protobuf_library(one):
    data = one.SerializeToString()
    template = transform_template(data)
    assert template.agrees(rows(data)).all()
    p, q = one.translation, one.rotation
    assert template.values(rows(data)).tobytes() == np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w]).tobytes()
    seconds, nanos = template.stamps(rows(data))
    assert (seconds[0], nanos[0]) == (one.timestamp.seconds, one.timestamp.nanos)
    assert (template.parent, template.child) == (one.parent_frame_id, one.child_frame_id)
    assert template.stamped == one.HasField("timestamp")


@given(transforms(), transforms())
def test_bytes_that_agree_with_a_template_are_read_right_by_it(one, other):
    first, second = one.SerializeToString(), other.SerializeToString()
    template = transform_template(first)
    if len(first) == len(second) and template.agrees(rows(second)).all():
        p, q = other.translation, other.rotation
        assert template.values(rows(second)).tobytes() == np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w]).tobytes()
        assert template.child == other.child_frame_id


@given(st.binary(max_size=60), st.integers(0, 200), st.integers(1, 255))
def test_whatever_a_template_accepts_the_protobuf_library_reads_the_same(noise, place, flip):
    base = bytearray(FrameTransform(child_frame_id="wand", parent_frame_id="w").SerializeToString() + noise)
    base[place % len(base)] ^= flip
    template = transform_template(bytes(base))
    if template is not None:
        one = FrameTransform.FromString(bytes(base))
        p, q = one.translation, one.rotation
        assert template.values(rows(bytes(base))).tobytes() == np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w]).tobytes()
        assert (template.parent, template.child) == (one.parent_frame_id, one.child_frame_id)


def test_repeated_and_unknown_fields_get_no_template():
    data = FrameTransform(child_frame_id="wand").SerializeToString()
    for strange in (data + data, data + b"\x32\x00", data + b"\x08\x01", b"\x1a\x05ab", b"\x1a\x01\xff", b"\x80"):
        assert transform_template(strange) is None


def test_a_stamp_that_int64_nanoseconds_cannot_hold_overflows():
    assert stamp_overflows(np.array([0, 2**34])) and stamp_overflows(np.array([-(2**34)]))
    assert not stamp_overflows(np.array([-(2**33), 2**33])) and not stamp_overflows(np.array([], dtype=np.int64))
