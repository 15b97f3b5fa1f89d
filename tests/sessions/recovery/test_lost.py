from dataclasses import replace
from pathlib import Path

from sessions.recovery.lost import LostChunk, Recovery

KEPT = Recovery(Path("out.mcap"), 20, 10, 5_000_000_000, 6_000_000_000)


def test_nothing_lost_is_whole_and_anything_lost_is_not():
    assert KEPT.whole and KEPT.sentences() == ["kept 10 frames and 20 messages"]
    chunk = LostChunk(7, 5_500_000_000, 5_700_000_000, 18, "damaged")
    parts = {"chunks": (chunk,), "bytes_skipped": 1, "bodies": ("a",), "attachments": ("m",), "unknown": 2}
    for name, value in parts.items():
        lost = replace(KEPT, **{name: value})
        assert not lost.whole and len(lost.sentences()) == 2


def test_a_lost_chunk_says_what_when_and_where():
    chunk = LostChunk(7, 5_500_000_000, 5_700_000_000, 18, "damaged")
    words = replace(KEPT, chunks=(chunk,)).sentences()[1]
    assert words == "lost 18 messages, 0.500 s to 0.700 s: the chunk at byte 7 is damaged"
    cut = LostChunk(7, 0, 0, None, "cut short")
    assert "an unknown number of messages: the chunk" in replace(KEPT, chunks=(cut,)).sentences()[1]
