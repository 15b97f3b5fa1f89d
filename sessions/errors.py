"""Every error of `sessions` is a `SessionError`, and its text is one sentence that ends in what to do.

SessionError
  MeshFileError      a mesh file or array that cannot be used
"""


class SessionError(Exception):
    """Anything wrong with a session or with what belongs to it."""


class MeshFileError(SessionError):
    """A mesh file, or arrays given as a mesh, that cannot be used."""
