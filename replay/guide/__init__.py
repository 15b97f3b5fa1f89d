"""The guide: one Markdown page per task, shipped with the package and printed by ``replay guide``."""
