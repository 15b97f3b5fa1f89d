import pytest

from sessions.errors import SessionError
from sessions.synthetic.assembly import Recording


@pytest.mark.parametrize("wrong", [{"noise": "loud"}, {"jitter": "odd"}, {"rate_hz": -1.0}])
def test_what_cannot_be_is_refused_by_name(wrong):
    with pytest.raises(SessionError, match=str(next(iter(wrong)))):
        Recording(**wrong)
