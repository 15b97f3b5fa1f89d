import ast
from pathlib import Path

import reference_reader
from mcap_samples import assert_same_frames, protobuf_messages, random_frames, write_foreign
from reference_reader import read_frames_plainly


def test_it_reads_what_the_protobuf_library_wrote(tmp_path):
    frames = random_frames(1, 60, 3, absent=0.2)
    path = write_foreign(tmp_path / "f.mcap", protobuf_messages(frames))
    assert_same_frames(read_frames_plainly(path, frames.names), frames)


def test_it_shares_no_code_with_the_fast_reader():
    tree = ast.parse(Path(reference_reader.__file__).read_text(encoding="utf-8"))
    modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module}
    ours = {name for name in modules if name.startswith("sessions")}
    assert ours == {"sessions.frames", "sessions.mcap_format.schemas"}
