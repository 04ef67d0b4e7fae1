"""Bring docs/tutorial.md up to date: run it, take over the numbers and the pictures.

Lines of its output keep their words. One whose words the program no longer prints is left as it is and
named, for a person to mend.

python -m pages.tutorial     (make docs-tutorial)
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import click

from idtool.presentation.style import few_colours
from pages.markdown import finished, same_words, steps

PAGE, PLANT, PICTURES = Path("docs/tutorial.md"), Path("docs/tutorial.toml"), Path("docs/images/tutorial")
#: Picture -> the file that a command of the tutorial writes.
TAKEN = {
    "gravity": "result/figures/gravity.png",
    "stribeck": "result/figures/stribeck.png",
    "residual_position": "result/figures/residual_position.png",
    "prediction": "result/figures/prediction.png",
    "guided": "guided.png",
}
_COLOURS = 64


def refreshed(said: str, printed: str) -> tuple[str, list[str]]:
    """An output as it is printed now, line by line, and the lines that are not printed any more."""
    lines = printed.splitlines()
    result, lost = [], []
    for line in said.splitlines():
        now = next((k for k, other in enumerate(lines) if same_words(line, other)), None)
        if now is None:
            result.append(line)
            lost += [line] if line.strip(" .") else []
        else:
            result.append(lines[now].rstrip())
            del lines[: now + 1]
    return "".join(f"{line}\n" for line in result), lost


@click.command()
def main() -> None:
    """Run the tutorial in a folder of its own and write the page."""
    text = PAGE.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(PLANT, folder / "axis.toml")
        for commands, said in steps(PAGE):
            printed = "".join(finished(words, folder) for words in commands)
            now, lost = refreshed(said, printed)
            if said:
                text = text.replace(f"```text\n{said}```", f"```text\n{now}```")
            for line in lost:
                click.echo(f"not printed any more: {line}")
        for picture, source in TAKEN.items():
            taken = (folder / source).read_bytes()
            (PICTURES / f"{picture}.png").write_bytes(few_colours(taken, _COLOURS))
    PAGE.write_text(text, encoding="utf-8")
    click.echo(f"written: {PAGE}")


if __name__ == "__main__":
    main()
