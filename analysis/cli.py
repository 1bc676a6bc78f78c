"""The command ``clie VERB ...``: a table from each verb to the module that answers it."""

import importlib
import sys

from clie_blocks import __version__
from clie_blocks.errors import ClieError, nearest
from clie_blocks.output import guarded

VERBS = {
    "example": ("clie_blocks.analysis.examples.command",
                "write logs with their robot file, to try the other verbs on"),
    "loop": ("clie_blocks.analysis.loop_command", "run the identification of the paper, Fig. 2"),
    "bounds": ("clie_blocks.analysis.stability_report.command",
               "say whether PD gains are safe, and why"),
    "reproduce": ("clie_blocks.analysis.reproduction.command",
                  "compare every number of the paper with ours"),
    "check": ("clie_blocks.analysis.law_check",
              "say whether a log is sound, and what it can show"),
    "robot": ("clie_blocks.analysis.records.robot_command",
              "start a robot file from a URDF, an MJCF or logs, or check one"),
    "identify": ("clie_blocks.analysis.identification.command",
                 "identify a recorded robot by CLIE and four other estimators"),
    "diagnose": ("clie_blocks.analysis.gap.command",
                 "say where the gap is, which effect causes it, how far it shrinks"),
    "export": ("clie_blocks.analysis.export.command",
               "put the correction into the model of your simulator, or into C or an FMU"),
    "replay": ("clie_blocks.analysis.export.replay_command",
               "run the corrected model in MuJoCo against a log"),
    "blind": ("clie_blocks.analysis.blind.command",
              "run sealed trials on robots of another engine"),
    "real": ("clie_blocks.analysis.real.command",
             "score the diagnosis on real machines whose truth is known"),
    "effects": ("clie_blocks.analysis.catalogue.pages",
                "show the catalogue of unmodelled effects"),
}

USAGE = """usage: clie VERB [options]

{verbs}

'clie VERB --help' lists the options of a verb; --version shows the version; --completion SHELL
prints a script that completes verbs and options: eval "$(clie --completion bash)".
Exit codes: 0 ok, 1 negative result (such as unsafe gains or a faulty log), 2 usage, 3 bad data,
4 not identifiable, 5 diverged, 70 a fault of clie, 130 interrupted."""


def main(argv: list[str] | None = None) -> int:
    """Run one verb and return its exit code, see `clie_blocks.output.guarded`."""
    return guarded(_dispatch, sys.argv[1:] if argv is None else list(argv))


def _dispatch(argv: list[str] | None) -> int | None:
    if argv and argv[0] == "--version":
        print(f"clie {__version__}")
    elif argv and argv[0] == "--completion":
        from clie_blocks.analysis.completion import script

        print(script(argv[1] if argv[1:] else "", {verb: text for verb, (_, text) in
                                                   VERBS.items()}, main), end="")
    elif not argv or argv[0] in ("-h", "--help"):
        width = max(map(len, VERBS))
        print(USAGE.format(verbs="\n".join(
            f"  {verb:{width}}  {text}" for verb, (_, text) in VERBS.items())))
    elif argv[0] not in VERBS:
        raise ClieError(f"no verb {argv[0]!r}; {nearest(argv[0], VERBS)}")
    else:
        return importlib.import_module(VERBS[argv[0]][0]).main(argv[1:])
    return 0
