"""``clie example``: logs with their robot file to try the other commands on."""

import argparse
import shlex
from pathlib import Path

from clie_blocks.analysis.examples import EXAMPLES, FOLDER
from clie_blocks.errors import ClieError, nearest
from clie_blocks.output import command_parser, print_table, run_main, to_json, write


def main(argv: list[str] | None = None) -> int:
    """Run the command; return 0 if the example was written, or the examples listed."""
    args = _parser().parse_args(argv)
    if args.name is None:
        _list(args.json)
        return 0
    folder = Path(args.folder or args.output or args.name)
    files = write_example(args.name, folder)
    if args.json:
        print(to_json({"name": args.name, "files": files}))
    else:
        print(f"wrote {folder}: {EXAMPLES[args.name]}")
        print(f"Next: clie diagnose {shlex.quote(str(folder))} -o out")
    return 0


def write_example(name: str, folder: Path) -> list[Path]:
    """Write the robot file and the logs of an example, and return their paths.

    Raises
    ------
    ClieError
        If there is no such example, or a file of another content stands where one is written.

    """
    if name not in EXAMPLES:
        raise ClieError(f"no example {name!r}; {nearest(name, EXAMPLES)}")
    contents = {folder / file.name: file.read_bytes()
                for file in sorted((FOLDER / name).iterdir())}
    for path, content in contents.items():
        if path.exists() and not (path.is_file() and path.read_bytes() == content):
            raise ClieError(f"{path} is there already and is left as it is; name another folder: "
                            f"clie example {name} DIR")
    return [write(path, content) for path, content in contents.items()]


def _list(as_json: bool) -> None:
    if as_json:
        print(to_json({"examples": EXAMPLES}))
        return
    print_table(("example", "what it is"), list(EXAMPLES.items()), "<<")
    print(f"Next: clie example {next(iter(EXAMPLES))}")


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(
        "clie example", "Write example logs with their robot file, or list what there is.",
        output_help="the same as DIR")
    parser.add_argument("name", nargs="?", metavar="NAME",
                        help="which; without it, all are listed")
    parser.add_argument("folder", nargs="?", metavar="DIR",
                        help="folder that is written; by default a new one of this name")
    return parser


if __name__ == "__main__":
    run_main(main)
