"""Made-up experiments: a module performs the procedure, and the TOML file of its name declares bench and effects.

`steps.py` holds what a student does at the bench, `lab.py` the bench and the hands, `record.py` makes the session.
"""
