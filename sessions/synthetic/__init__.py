"""Sessions made up with a known truth: two in closed form, a bench with planted bumps, nine experiments, a crowd.

Nothing here asks a geometry engine: truth comes from formulas, so it cannot share an error with what is audited.
"""
