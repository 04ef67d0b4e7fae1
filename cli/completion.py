"""`ffc-id completion`: the script with which a shell completes commands, options and their words."""

from __future__ import annotations

import os
from typing import Any

import click
from click.shell_completion import (
    BashComplete,
    CompletionItem,
    ShellComplete,
    add_completion_class,
    get_completion_class,
    split_arg_string,
)

from .words import Choice

#: The variable through which a shell asks; click derives it from the program's name.
VARIABLE = "_FFC_ID_COMPLETE"
SHELLS = {
    "bash": 'add to ~/.bashrc: eval "$(ffc-id completion bash)"',
    "zsh": 'add to ~/.zshrc, below compinit: eval "$(ffc-id completion zsh)"',
    "fish": "run once: ffc-id completion fish > ~/.config/fish/completions/ffc-id.fish",
}

#: Unlike click's own this one gets words right that hold what bash parts words at, such as sim:paper.
_BASH = """\
%(complete_func)s() {
    local IFS=$'\\n' type value
    COMPREPLY=()
    while IFS=, read -r type value; do
        case $type in
            dir) compopt -o dirnames ;;
            file) compopt -o default ;;
            plain) COMPREPLY+=("$(printf %%q "$value")") ;;
        esac
    done < <(COMP_LINE="${COMP_LINE:0:COMP_POINT}" COMP_WORDBREAKS="$COMP_WORDBREAKS" \\
        %(complete_var)s=bash_complete "$1")
    if [[ ${#COMPREPLY[@]} == 1 && ${COMPREPLY[0]} == *[/:] ]]; then
        compopt -o nospace
    fi
}
complete -o nosort -F %(complete_func)s %(prog_name)s
"""


class Bash(BashComplete):
    """Bash; it is asked for the rest of a word after the last character at which it parts words."""

    source_template = _BASH

    def get_completion_args(self) -> tuple[list[str], str]:
        words = split_arg_string(os.environ["COMP_LINE"])[1:]
        if os.environ["COMP_LINE"][-1:].isspace() or not words:
            return words, ""
        return words[:-1], words[-1]

    def complete(self) -> str:
        args, incomplete = self.get_completion_args()
        items = self.get_completions(args, incomplete)
        # of --rig=sim:p only sim:p is the value, and bash wants what follows the colon
        value = incomplete.partition("=")[2] if incomplete.startswith("-") else incomplete
        last = max((value.rfind(sign) for sign in ":=" if sign in os.environ["COMP_WORDBREAKS"]), default=-1)
        return "\n".join(self.format_completion(_without(item, last + 1)) for item in items)


def _without(item: CompletionItem[Any], count: int) -> CompletionItem[Any]:
    return CompletionItem(item.value[count:]) if item.type == "plain" else item


def register() -> None:
    """Let click use our bash script."""
    add_completion_class(Bash)


@click.command()
@click.argument("shell", type=Choice(tuple(SHELLS)), metavar="bash|zsh|fish")
def completion(shell: str) -> None:
    """Print the completion script of a shell; its first lines say where to put it.

    Commands, options, file names and the words that options take (rigs, recipes, effects) are completed.

    \b
    eval "$(ffc-id completion bash)"
    """
    from .commands import ffc_id

    register()
    made: type[ShellComplete] | None = get_completion_class(shell)
    assert made is not None
    script = made(ffc_id, {}, "ffc-id", VARIABLE).source()
    first, newline, rest = script.partition("\n")
    hint = f"# To install it, {SHELLS[shell]}\n"
    # zsh looks for its directive in the first line
    click.echo(first + newline + hint + rest if first.startswith("#compdef") else hint + script, nl=False)
