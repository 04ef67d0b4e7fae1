"""Execute docs/example.ipynb and write what its cells give into it, without Jupyter.

python -m pages.notebook     (make docs-notebook)
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import os
import tempfile
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from idtool.presentation.style import few_colours

NOTEBOOK = Path("docs/example.ipynb")
_DPI, _COLOURS = 70, 32


def cells(notebook: Path) -> list[str]:
    """The code of a notebook, cell by cell."""
    document = json.loads(notebook.read_text(encoding="utf-8"))
    return ["".join(cell["source"]) for cell in document["cells"] if cell["cell_type"] == "code"]


def execute(code: str, names: dict[str, Any]) -> tuple[str, Any]:
    """Run a cell in a namespace; what it printed, and the value of its last line if that is one."""
    body = ast.parse(code).body
    last = None
    if body and isinstance(end := body[-1], ast.Expr):
        last = ast.Expression(end.value)
        body.pop()
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(ast.Module(body, []), "cell", "exec"), names)
        value = eval(compile(last, "cell", "eval"), names) if last is not None else None
    return printed.getvalue(), value


def outputs(printed: str, value: Any, number: int) -> list[dict[str, Any]]:
    """Both as Jupyter keeps them."""
    result: list[dict[str, Any]] = []
    if printed:
        result.append({"name": "stdout", "output_type": "stream", "text": printed.splitlines(keepends=True)})
    if value is None:
        return result
    shown: dict[str, Any] = {"text/plain": repr(value).splitlines(keepends=True)}
    if isinstance(value, Figure):
        shown["image/png"] = _picture(value)
    elif hasattr(value, "_repr_html_") and (page := value._repr_html_()):
        shown["text/html"] = page.splitlines(keepends=True)
    result.append({"data": shown, "execution_count": number, "metadata": {}, "output_type": "execute_result"})
    return result


def _picture(figure: Figure) -> str:
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png", dpi=_DPI)
    return base64.b64encode(few_colours(drawn.getvalue(), _COLOURS)).decode("ascii")


def main() -> None:
    """Run the cells in an empty folder and write the notebook anew."""
    matplotlib.use("Agg")
    document = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    names: dict[str, Any] = {}
    number, home = 0, Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for cell in document["cells"]:
            if cell["cell_type"] == "code":
                number += 1
                cell["execution_count"] = number
                cell["outputs"] = outputs(*execute("".join(cell["source"]), names), number)
        os.chdir(home)
    NOTEBOOK.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    print(f"written: {NOTEBOOK}")


if __name__ == "__main__":
    main()
