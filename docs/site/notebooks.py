"""Run the notebooks of ``docs/notebooks``, or those that are named, and store their outputs."""

import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).parents[1] / "notebooks"

for path in [FOLDER / name for name in sys.argv[1:]] or sorted(FOLDER.glob("*.ipynb")):
    notebook = nbformat.read(path, 4)
    # Without times, so that the files differ only where outputs do.
    how = {"record_timing": False, "coalesce_streams": True, "timeout": 3600}
    NotebookClient(notebook, **how).execute()
    nbformat.write(notebook, path)
    print(path.name)
