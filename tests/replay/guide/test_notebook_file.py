"""The notebook is its page: every block is a cell, in order, and a kernel of Jupyter runs them all."""

import re
from importlib.util import find_spec

import pytest

from replay.guide.notebook_file import PAGE, notebook
from replay.guide.pages import page


def test_every_block_of_the_page_is_a_cell_of_code_and_all_other_text_is_markdown():
    text = page(PAGE)
    cells = notebook(text)["cells"]
    code = [cell["source"] for cell in cells if cell["cell_type"] == "code"]
    assert code == [block.strip() for block in re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S)] != []
    assert "".join(cell["source"] for cell in cells if cell["cell_type"] == "markdown").startswith("# In a notebook")
    assert len({cell["id"] for cell in cells}) == len(cells)


@pytest.mark.slow
@pytest.mark.skipif(find_spec("nbclient") is None, reason="nbclient is no part of `test`")
def test_a_kernel_runs_every_cell(tmp_path):
    import nbformat
    from nbclient import NotebookClient

    made = nbformat.from_dict(notebook(page(PAGE)))
    nbformat.validate(made)
    NotebookClient(made, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [output for cell in made.cells if cell.cell_type == "code" for output in cell.outputs]
    pages = [output["data"]["text/html"] for output in shown if "text/html" in output.get("data", {})]
    assert any("<table" in page for page in pages)
    assert any("<iframe" in page and "svg" in page for page in pages)
