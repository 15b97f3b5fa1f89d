"""What every part of the tool stands on: facts and small functions that know nothing of runs, files or pictures."""
