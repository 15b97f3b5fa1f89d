"""The picture: a Rerun recording of a run, its blueprint and its viewer. A view, never the archive."""
