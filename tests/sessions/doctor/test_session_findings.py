import subprocess
import sys

from planted_faults import FAULTS, clean

from sessions.doctor.pose_pass import look_through
from sessions.doctor.session_findings import examine_session, frame_findings


def test_a_session_is_examined_without_loading_a_container():
    code = "import sys, sessions.doctor.session_findings; print('mcap' in sys.modules, 'trimesh' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


def test_a_pass_that_was_made_already_is_used():
    draft = clean()
    FAULTS["frozen pose"](draft, 1, 300)
    session = draft.session()
    looked = look_through([session.frames])
    found = [*examine_session(session, looked)]
    assert found == [*examine_session(session)]
    assert [one for one in frame_findings(looked, session.scene, {}) if one not in found] == []
    assert "frozen" in {one.code for one in found}
