"""Progress that a test looks at."""

from contextlib import contextmanager


class Watched:
    """Keeps what each stage of a run was said to be, and how much of it was reported done."""

    def __init__(self):
        self.stages = {}

    @contextmanager
    def stage(self, name, total=None, unit="frames"):
        done = []
        yield done.append
        self.stages[name] = (total, sum(done))
