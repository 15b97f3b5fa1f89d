"""The run folder: tables in Parquet, a summary in JSON; written under a temporary name and renamed."""
