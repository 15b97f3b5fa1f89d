"""A recording with less of a person in it, and what that changes in its contacts."""
