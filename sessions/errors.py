"""Every error of `sessions` is a `SessionError`, and its text is one sentence that ends in what to do."""

from collections.abc import Sequence


class SessionError(Exception):
    """Anything wrong with a session or with what belongs to it."""

    def __str__(self) -> str:
        """The sentence; where it repeats text of a file that cannot be printed, escaped."""
        message = super().__str__()
        return message if message.isprintable() else message.encode("unicode_escape").decode()


class WrongInputError(SessionError, TypeError):
    """The input is of another kind than the requested one."""


class MeshFileError(SessionError):
    """A mesh file, or arrays given as a mesh, that cannot be used."""

    code = "mesh-unreadable"
    """Why, as the doctor calls it."""


class EmptyMeshError(MeshFileError):
    """A mesh file without a triangle."""

    code = "mesh-empty"


class SessionFileError(SessionError):
    """A session file that cannot be read, or a session that a file cannot hold."""

    code = "unreadable"
    """Why, as the doctor calls it: a key of `sessions.mcap.refusals.CURES`."""
    what = ""
    """What is wrong, without the file and the cure; "" where only the whole sentence is known."""


class TornFileError(SessionFileError):
    """A session file that ends without its index, because its recording was cut short."""

    code = "torn"


def first_of(faults: Sequence[str]) -> str:
    """The first of several sentences about a scene, and who lists all.

    No number: a reader stops before the meshes and the effects, in which the check finds more.
    """
    return "".join(faults[:1]) + "; and more: `replay scene check` lists every fault" * (len(faults) > 1)


class SceneError(SessionError):
    """A scene that says something impossible or something unknown; ``faults`` are all there are."""

    def __init__(self, *faults: str) -> None:
        self.faults = faults
        super().__init__(first_of(faults))


class ImportFileError(SessionError):
    """A recording of another program that cannot be imported."""


class SceneSourceError(SessionError):
    """A scene of another program (MJCF, URDF, USD, glTF) that cannot be taken."""
