"""Arrow without pandas: for the first number of Python that it takes it loads pandas, 0.2 s and 36 MB of a run."""

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType


class WithoutPandas(MetaPathFinder):
    """Finds no pandas."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Raise for pandas; leave every other module to the other finders."""
        del path, target
        if fullname == "pandas":
            raise ModuleNotFoundError("Arrow is not to load pandas", name=fullname)
        return None


def leave_pandas_out() -> None:
    """Have Arrow look for pandas once and find none; a later ``to_pandas`` loads it, and ``import pandas`` too.

    For a process of the command line, which hands Arrow no object of pandas.
    """
    import pyarrow as pa

    if "pandas" in sys.modules:
        return
    finder = WithoutPandas()
    sys.meta_path.insert(0, finder)
    try:
        pa.array([0])
    finally:
        sys.meta_path.remove(finder)
