"""Memory, workers and progress of a process, kernels compiled or in Python, and the scripts of `.ci` as modules.

Linux hands ``ru_maxrss`` of whoever started a program down to it, so a small program under a large test runner looks
large; ``VmHWM`` begins anew. Programs that tests start find this file with ``PYTHONPATH``.
"""

import gc
import os
import shutil
import sys
from contextlib import contextmanager, suppress
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

HERE = Path(__file__).resolve().parents[1]


def environment() -> dict[str, str]:
    """Variables of a program that is to find this file and the project."""
    paths = [str(HERE.parent), str(HERE), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}


def peak_bytes() -> int:
    """Most bytes this process held at once."""
    status = Path("/proc/self/status")
    if status.is_file():
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) * 1024
    if sys.platform == "win32":
        import psutil

        return int(psutil.Process().memory_info().peak_wset)
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def spawned_by(process=None):
    """Those that are alive below a process, by default this one."""
    import psutil

    result = []
    for child in (process or psutil.Process()).children(recursive=True):
        with suppress(psutil.Error):  # it ended meanwhile
            if "spawn_main" in " ".join(child.cmdline()):
                result.append(child)
    return result


class Watched:
    """Keeps what each stage of a run was said to be, and how much of it was reported done."""

    def __init__(self):
        self.stages = {}

    @contextmanager
    def stage(self, name, total=None, unit="frames"):
        done = []
        yield done.append
        self.stages[name] = (total, sum(done))


COMMON = ("exact", "hybrid-qaco", "discrete")
"""Their kernels are those of most tests; the other detectors are left to compile while tests run."""
LONGEST = ("continuous",)
"""What takes longest to compile comes first of the others."""


def compile_for_tests(done):
    """Compiles kernels before tests need them; makes the file ``done`` when the common ones are compiled."""
    from support.shapes import lab_bodies_and_motion

    from cdcore import DETECTORS, create_detector, detect_live, triangles_intersect
    from cdcore.detectors.compile_beside import compile_kernels

    gc.disable()  # looking for cycles takes a second of the processor; 230 MB more are held
    try:
        compile_kernels()
        bodies, motion = lab_bodies_and_motion(frames=8)
        for name in dict.fromkeys([*COMMON, *LONGEST, *DETECTORS]):
            detector = create_detector(name, bodies)
            detector.detect(motion, faces=True)
            if detector.online:
                detect_live(detector, motion)
            if name == COMMON[-1]:
                Path(done).touch()
                triangles_intersect(bodies[0].mesh.triangles[None, :2])
    except BaseException:
        shutil.rmtree(Path(done).parent)  # whoever waits for the file goes on and compiles itself
        raise


@contextmanager
def kernels_in_python():
    """Parts of kernels are the Python functions that they are, with every operation of the machine in Python too.

    A kernel that only a test calls compiles for a second; kernels of the product are compiled as ever.
    """
    import numpy as np
    import pytest

    modules = [module for name, module in sys.modules.items() if name.startswith("cdcore.")]
    with pytest.MonkeyPatch.context() as patch, np.errstate(all="ignore"):
        for module in modules:
            for name, value in list(vars(module).items()):
                if hasattr(value, "interpreted"):
                    patch.setattr(module, name, value.interpreted)
        yield


FOLDER = Path(__file__).resolve().parents[2] / ".ci"


def script(name):
    """The module of this name, which finds its neighbours."""
    if str(FOLDER) not in sys.path:
        sys.path.append(str(FOLDER))
    spec = spec_from_file_location(name, FOLDER / f"{name}.py")
    module = sys.modules[name] = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
