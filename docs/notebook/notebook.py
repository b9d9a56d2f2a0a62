#!/usr/bin/env python3
"""Runs the notebook without Jupyter, and makes the book's page of it.

    notebook.py run     runs all cells and keeps their outputs in the notebook; needs the package
                        `wag` with matplotlib, and the program `wag`
    notebook.py page    writes the book's page and its pictures from the notebook
    notebook.py check   fails where page and pictures are not those of the notebook
"""

import base64
import contextlib
import io
import json
import os
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
NOTEBOOK = HERE / "film-to-throw.ipynb"
BOOK = HERE.parent / "src"
PAGE = BOOK / "notebook.md"
PICTURES = BOOK / "images"
STEM = "notebook-"


def code_cells(notebook):
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def run_cells(notebook, folder):
    """Runs the code cells in `folder`; gives their names, and what each printed and drew."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names, outputs = {"__name__": "__main__"}, []
    before = os.getcwd()
    os.chdir(folder)
    try:
        for number, cell in enumerate(code_cells(notebook), start=1):
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile("".join(cell["source"]), f"<cell {number}>", "exec"), names)
            drawn = [_png(plt.figure(figure)) for figure in plt.get_fignums()]
            plt.close("all")
            outputs.append((printed.getvalue(), drawn))
    finally:
        os.chdir(before)
    return names, outputs


def _png(figure):
    kept = io.BytesIO()
    # Without the version of matplotlib.
    figure.savefig(kept, format="png", dpi=90, metadata={"Software": None})
    return kept.getvalue()


def run():
    """Runs the notebook in a folder of its own and keeps what its cells printed and drew."""
    notebook = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        _, outputs = run_cells(notebook, folder)
    for number, (cell, (printed, drawn)) in enumerate(zip(code_cells(notebook), outputs), start=1):
        cell["execution_count"] = number
        cell["outputs"] = [
            {
                "output_type": "display_data",
                "data": {"image/png": base64.b64encode(png).decode()},
                "metadata": {},
            }
            for png in drawn
        ]
        if printed:
            text = printed.splitlines(keepends=True)
            stream = {"output_type": "stream", "name": "stdout", "text": text}
            cell["outputs"].append(stream)
    NOTEBOOK.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def page():
    """The page, and its pictures by their names."""
    notebook = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    parts, pictures = [], {}
    for cell in notebook["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        parts.append(f"```python\n{source}\n```")
        for output in cell["outputs"]:
            if output["output_type"] == "stream":
                parts.append(f"```text\n{''.join(output['text']).rstrip()}\n```")
                continue
            name = f"{STEM}{len(pictures) + 1}.png"
            pictures[name] = base64.b64decode(output["data"]["image/png"])
            parts.append(f"![what the cell above draws](images/{name})")
    link = "https://github.com/wiggle-and-go/wag/blob/main/docs/notebook/film-to-throw.ipynb"
    parts.insert(1, f"This page is [a notebook]({link}) with what its cells printed and drew.")
    return "\n\n".join(parts) + "\n", pictures


def write():
    """Writes page and pictures."""
    text, pictures = page()
    PAGE.write_text(text, encoding="utf-8")
    for old in PICTURES.glob(f"{STEM}*.png"):
        old.unlink()
    for name, png in pictures.items():
        (PICTURES / name).write_bytes(png)


def check():
    """Compares page and pictures with the notebook."""
    text, pictures = page()
    kept = {path.name: path.read_bytes() for path in PICTURES.glob(f"{STEM}*.png")}
    differing = {name for name in kept | pictures if kept.get(name) != pictures.get(name)}
    if not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != text:
        differing.add(PAGE.name)
    if differing:
        listed = ", ".join(sorted(differing))
        sys.exit(f"not as {NOTEBOOK.name} has it: {listed}; write it with `notebook.py page`")


if __name__ == "__main__":
    commands = {"run": run, "page": write, "check": check}
    if len(sys.argv) != 2 or sys.argv[1] not in commands:
        sys.exit(__doc__)
    commands[sys.argv[1]]()
