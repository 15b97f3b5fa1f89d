"""Result of ``replay.run``: the result of the pipeline with methods for notebooks."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from replay.document import run_result
from replay.errors import OutputError
from replay.running.by_label import ByLabel
from sessions.temporary_folders import temporary_folder

if TYPE_CHECKING:
    from replay.show.notebook import Plot


@dataclass(frozen=True, eq=False, repr=False)
class RunResult(run_result.RunResult):
    """The outcome of ``replay.run``: what it computed, its document, and where it was written.

    In a notebook it shows itself as its ranking. Its mappings by label answer an unknown label with those there are.
    """

    @classmethod
    def of(cls, computed_result: run_result.RunResult) -> RunResult:
        """The same result, to be shown."""
        field_values = {field.name: getattr(computed_result, field.name) for field in fields(computed_result)}
        by_label = ("detections", "comparisons", "episodes", "misses", "false", "matches", "causes", "detectors")
        return cls(**field_values | {name: ByLabel(field_values[name]) for name in by_label})

    def __repr__(self) -> str:
        from replay.show.notebook import run_text

        return run_text(self)

    def _repr_html_(self) -> str:
        from replay.show.notebook import run_html

        return run_html(self)

    def plot(self) -> Plot:
        """Plot of misses over time and against milliseconds, as in the report.

        Raises ``AuditError``: no detector was compared with another.
        """
        from replay.show.notebook import run_plot

        return run_plot(self)

    def to_pandas(self, name: str) -> Any:
        """Return a table as a pandas frame: ``episodes``, ``misses``, ``false``, ``events`` or ``metrics``.

        Raises ``OutputError``: pandas is not installed.
        """
        try:
            import pandas  # noqa: F401
        except ImportError as error:
            raise OutputError("pandas is not installed; pip install pandas") from error
        return self._arrow_table(name).to_pandas()

    def to_polars(self, name: str) -> Any:
        """Return a table as a polars frame, named as for ``to_pandas``.

        Raises ``OutputError``: polars is not installed.
        """
        try:
            import polars
        except ImportError as error:
            raise OutputError("polars is not installed; pip install polars") from error
        return polars.from_arrow(self._arrow_table(name))

    def _arrow_table(self, name: str) -> Any:
        from replay.show.results.parquet import with_keys
        from replay.show.results.parquet_tables import metrics_table

        if name == "metrics":
            return with_keys(metrics_table(self), self)
        if name not in self.tables:
            raise OutputError(f"no table {name!r}; there are: {', '.join([*self.tables, 'metrics'])}")
        return with_keys(self.tables[name].to_arrow(), self)

    def write(self, folder: str | Path, *, force: bool = False, picture: bool = True) -> RunResult:
        """Write the run folder with its report, and return the result that knows where it is.

        ``force`` replaces an earlier run folder; without ``picture`` there is no recording for Rerun. Raises
        ``OutputError``.
        """
        from replay.show.results.run_folder import write_run_folder

        return replace(self, out=write_run_folder(self, Path(folder), force=force, picture=picture))

    def view(self, *, width: int = 1100, height: int = 700) -> Any:
        """The picture in this notebook, in Rerun's viewer; ``replay.view(folder)`` opens a window instead.

        Raises ``OutputError``: the extra ``notebook`` is not installed.
        """
        from replay.show.rerun_log.viewer import notebook_viewer, notebook_widget
        from replay.show.results.run_folder import PICTURE_FILE

        notebook_widget()  # without it nothing is written
        if self.out is not None and (self.out / PICTURE_FILE).is_file():
            return notebook_viewer(self.out / PICTURE_FILE, width, height)
        with temporary_folder() as folder:
            return notebook_viewer(self.write(folder / "run").out / PICTURE_FILE, width, height)  # type: ignore[operator]
