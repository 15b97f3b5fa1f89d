"""Base of the tool: facts and small functions that know nothing of runs, files or pictures."""
