"""Titration of sodium carbonate with hydrochloric acid: two end points, of which the second is twice the first."""

from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.titration import equivalence_ml, titrate


def perform(lab: Lab) -> None:
    """Run in past the second end point."""
    # One proton for each carbonate, then another for each hydrogen carbonate.
    first_ml = equivalence_ml(lab)
    titrate(lab, (first_ml, 2.0 * first_ml))
