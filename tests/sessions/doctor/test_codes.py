import re
from pathlib import Path

from sessions.doctor import codes
from sessions.doctor.codes import CODES


def test_every_code_says_what_it_means_and_what_to_do():
    for code, spec in CODES.items():
        assert spec.meaning and spec.fix and not spec.fix.endswith("."), code
        assert spec.group in {"structure", "time", "pose", "scale", "mesh", "scene"}


def test_every_code_is_given_somewhere_and_none_that_is_unknown():
    folder = Path(codes.__file__).parent
    text = "".join(path.read_text("utf-8") for path in folder.glob("*.py") if path.name != "codes.py")
    quoted = set(re.findall(r'"([a-z]+(?:-[a-z]+)*)"', text))
    assert set(CODES) <= quoted
