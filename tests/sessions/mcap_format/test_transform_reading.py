import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from hypothesis import given
from hypothesis import strategies as st

from sessions.mcap_format import transform_reading
from sessions.mcap_format.transform_reading import TransformReader, transform_template


def laid_out(messages):
    ends = np.cumsum([len(message) for message in messages])
    return b"".join(messages), ends - [len(message) for message in messages], ends


def cells(samples):
    return {
        (int(row), part.child): (int(time), part.values[number].tobytes())
        for part in samples
        for number, (row, time) in enumerate(zip(part.rows, part.sample_ns, strict=True))
    }


def messages_of(count, bodies, seed=0):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        message = FrameTransforms()
        for body in rng.permutation(bodies)[: rng.integers(0, bodies + 1)]:
            one = message.transforms.add(parent_frame_id="world", child_frame_id=f"body {body}")
            one.timestamp.seconds = int(rng.integers(0, 3))
            one.timestamp.nanos = int(rng.integers(0, 10 ** rng.integers(1, 9)))
            one.translation.x, one.rotation.w = rng.normal(), float(rng.integers(0, 2))
        yield message.SerializeToString()


def counted(monkeypatch):
    parsed = []
    plain = TransformReader._parsed
    noted = lambda self, row, data: parsed.append(row) or plain(self, row, data)  # noqa: E731
    monkeypatch.setattr(TransformReader, "_parsed", noted)
    return parsed


def read(messages, reader=None):
    return (reader or TransformReader(ValueError)).read(*laid_out(messages), 10**9)


def test_any_order_and_choice_of_bodies_is_read_without_the_protobuf_library(monkeypatch):
    parsed = counted(monkeypatch)
    messages = list(messages_of(500, 6))
    found = cells(read(messages))
    assert parsed == []
    expected = {}
    for row, data in enumerate(messages):
        for one in FrameTransforms.FromString(data).transforms:
            p, q, t = one.translation, one.rotation, one.timestamp
            values = np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w]).tobytes()
            expected[row, one.child_frame_id] = (t.seconds * 10**9 + t.nanos, values)
    assert found == expected


def test_messages_with_strange_fields_fall_back_and_the_others_do_not(monkeypatch):
    parsed = counted(monkeypatch)
    messages = list(messages_of(60, 3))
    for row in (4, 17):
        messages[row] = messages[row] + b"\x12\x00"
    messages[30] = b"\x0a\x04\x1a\x02ab\x12\x01x"
    found = cells(read(messages))
    assert parsed == [4, 17, 30]
    assert found[30, "ab"][1] == np.zeros(7).tobytes()
    assert {row for row, _ in found} == {
        row for row, m in enumerate(messages) if FrameTransforms.FromString(m).transforms
    }


def test_layouts_beyond_the_bound_are_still_read_right(monkeypatch):
    messages = list(messages_of(300, 6))
    expected = cells(read(messages))
    monkeypatch.setattr(transform_reading, "LAYOUTS_PER_LENGTH", 1)
    monkeypatch.setattr(transform_reading, "STEPS", 3)
    parsed = counted(monkeypatch)
    assert cells(read(messages)) == expected and len(parsed) > 20


def test_a_stamp_beyond_int64_is_the_error_of_the_caller():
    for extra in (b"", b"\x12\x00"):
        message = FrameTransforms()
        message.transforms.add(child_frame_id="a").timestamp.seconds = 2**40
        with pytest.raises(ValueError, match="beyond the year 2262"):
            read([message.SerializeToString() + extra])


def rows(data):
    return np.frombuffer(data, dtype=np.uint8)[None]


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
