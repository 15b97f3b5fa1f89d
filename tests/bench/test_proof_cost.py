"""What the proof of a run costs beside the run."""

from time import process_time

import numpy as np
import pytest

import replay
from sessions import write_session
from sessions.synthetic.bench_bumps import make_bench_bumps

pytestmark = pytest.mark.bench
AT_MOST = 0.20


def test_a_proof_costs_less_than_a_fifth_of_the_run(tmp_path):
    write_session(make_bench_bumps()[0], tmp_path / "s.mcap")

    def seconds(proof, k):
        begin = process_time()
        replay.run(
            tmp_path / "s.mcap", detectors="slow=discrete[rate_hz=22.5]", out=tmp_path / f"{proof}{k}", proof=proof
        )
        return process_time() - begin

    seconds(True, "warm")
    plain, proven = np.min([[seconds(proof, k) for proof in (False, True)] for k in range(4)], axis=0)
    print(f"\na run takes {plain:.2f} s of processor time, with a proof {proven / plain:.3f} of that")
    assert proven <= (1.0 + AT_MOST) * plain
