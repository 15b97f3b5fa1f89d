import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.records import Message

from sessions.mcap_format.record_block import RecordBlock

times = st.integers(0, 2**62)
message = st.tuples(st.integers(0, 9), st.integers(0, 2**32 - 1), times, times, st.binary(max_size=40))
messages = st.lists(message, max_size=8)


def parts(block):
    return (
        block.data,
        *(getattr(block, n).tolist() for n in ("starts", "channel", "log_ns", "group_ends", "group_counts")),
    )


@given(messages)
def test_the_records_are_those_of_the_mcap_library(given_messages):
    builder = RecordBuilder()
    starts = []
    for channel, sequence, log, publish, payload in given_messages:
        starts.append(builder.count)
        Message(channel, log, payload, publish, sequence).write(builder)
    block = RecordBlock.of(given_messages)
    assert block.data == builder.end() and block.starts.tolist() == starts
    assert block.log_ns.tolist() == [message[2] for message in given_messages]


@given(messages.filter(bool), st.integers(1, 9))
def test_parts_joined_again_are_the_whole(given_messages, groups):
    whole = RecordBlock.of(given_messages)
    head, rest = whole.split(groups)
    assert len(head.group_ends) == min(groups, len(given_messages))
    assert parts(RecordBlock.join([head, rest])) == parts(whole)
    assert np.array_equal(head.group_ends[-1:], [len(head.data)])
