"""The page of ``replay fix``: hulls before and pieces after, on one motion."""
