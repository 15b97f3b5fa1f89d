"""A run as a folder to send to somebody: the report with the live picture beside it, for a browser and nothing else."""
