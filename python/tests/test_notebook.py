"""docs/notebook.ipynb runs in the demo's folder and prints what is committed; CRUMPLE_WRITE_DOCS=1 writes its outputs."""

import os
import re
import shutil
from pathlib import Path

import nbformat
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parents[2] / "docs/notebook.ipynb"


def plain(output):
    """The output without what differs from run to run: its number, and a picture's bytes, which fonts change."""
    if output.output_type == "stream":
        return output.text
    assert output.output_type != "error", output.traceback
    return "picture" if "image/png" in output.data else output.data["text/plain"]


def outputs(notebook):
    return [[plain(output) for output in cell.outputs] for cell in notebook.cells if cell.cell_type == "code"]


def test_the_notebook_prints_what_is_committed(tmp_path):
    shutil.copytree(os.environ["CRUMPLE_DEMO"], tmp_path / "demo")
    committed = nbformat.read(NOTEBOOK, as_version=4)
    assert len(committed.cells) <= 12
    executed = nbformat.from_dict(committed)
    client = NotebookClient(executed, timeout=300, resources={"metadata": {"path": tmp_path / "demo"}})
    client.execute()
    for cell in executed.cells:
        cell.metadata.pop("execution", None)
        # Warnings name a file of the kernel.
        if "outputs" in cell:
            cell.outputs = [output for output in cell.outputs if output.get("name") != "stderr"]
        for output in cell.get("outputs", []):
            # Tables as text, so that a difference can be read.
            if "data" in output:
                output.data.pop("text/html", None)
            output.get("metadata", {}).clear()
    if os.environ.get("CRUMPLE_WRITE_DOCS"):
        nbformat.write(executed, NOTEBOOK)
        committed = nbformat.read(NOTEBOOK, as_version=4)
    assert outputs(executed) == outputs(committed)
    assert "picture" in str(outputs(executed)) and not re.search(r"/tmp/|/root/|/home/", str(outputs(executed)))
