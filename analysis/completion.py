"""Scripts by which a shell completes the verbs, options and examples of ``clie``."""

import contextlib
import io
import re
from collections.abc import Callable, Mapping

from clie_blocks.analysis.examples import EXAMPLES
from clie_blocks.errors import ClieError, nearest

BASH = """\
_clie() {{
    local verb="${{COMP_WORDS[1]}}" word="${{COMP_WORDS[COMP_CWORD]}}" words=""
    if [ "$COMP_CWORD" -eq 1 ]; then words="{verbs}"; else
        case "$verb" in
{cases}
        esac
    fi
    COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _clie clie
"""
ZSH = "autoload -U +X bashcompinit && bashcompinit\n"


def script(shell: str, verbs: Mapping[str, str], run: Callable[[list[str]], int]) -> str:
    """Return the script of a shell.

    Parameters
    ----------
    shell : str
        ``bash``, ``zsh`` or ``fish``.
    verbs : mapping of str to str
        What each verb does.
    run : callable
        ``run([verb, "--help"])`` prints the help of a verb.

    Raises
    ------
    ClieError
        If there is no script for the shell.

    """
    writers = {"bash": _bash, "zsh": _zsh, "fish": _fish}
    if shell not in writers:
        raise ClieError(f"no script for the shell {shell!r}; {nearest(shell, writers)}")
    return writers[shell](verbs, {verb: _words(verb, run) for verb in verbs})


def _words(verb: str, run: Callable[[list[str]], int]) -> list[str]:
    """Options of a verb, as its help lists them, and the names of examples."""
    shown = io.StringIO()
    with contextlib.redirect_stdout(shown), contextlib.suppress(SystemExit):
        run([verb, "--help"])
    options = re.findall(r"^  (?:-\w(?: \S+)?, )?(--[\w-]+)", shown.getvalue(), re.M)
    return [*dict.fromkeys(options), *(EXAMPLES if verb == "example" else ())]


def _bash(verbs: Mapping[str, str], words: Mapping[str, list[str]]) -> str:
    """Words of the verb, else files."""
    cases = "\n".join(f'            {verb}) words="{" ".join(words[verb])}" ;;' for verb in verbs)
    return BASH.format(verbs=" ".join(verbs), cases=cases)


def _zsh(verbs: Mapping[str, str], words: Mapping[str, list[str]]) -> str:
    return ZSH + _bash(verbs, words)


def _fish(verbs: Mapping[str, str], words: Mapping[str, list[str]]) -> str:
    """Words with what each verb does."""
    lines = [f"complete -c clie -n __fish_use_subcommand -a {verb} -d '{text}'"
             for verb, text in verbs.items()]
    lines += [f"complete -c clie -n '__fish_seen_subcommand_from {verb}' "
              + (f"-l {word[2:]}" if word.startswith("--") else f"-a {word}")
              for verb in verbs for word in words[verb]]
    return "\n".join(lines) + "\n"
