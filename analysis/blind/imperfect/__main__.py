"""``python -m clie_blocks.analysis.blind.imperfect``: a copy of a robot's folder with a damage."""

import argparse
import sys

from clie_blocks.errors import ClieError, nearest
from clie_blocks.output import command_parser, run_main, to_json


def main(argv: list[str] | None = None) -> int:
    """Write the copy, or list the damages; return 0."""
    options = _parser().parse_args(argv)
    from clie_blocks.analysis.blind.imperfect.damages import DAMAGES, damage
    from clie_blocks.analysis.blind.imperfect.export import DoesNotApplyError

    if options.folder is None:
        for one in DAMAGES.values():
            print(f"{one.name:22}{one.kind:13}{one.sentence}")
        return 0
    if options.damage not in DAMAGES:
        raise ClieError(f"--damage {options.damage} is not known; "
                        f"{nearest(str(options.damage), DAMAGES)}")
    try:
        chosen = damage(options.damage, options.folder, options.output, options.seed)
    except DoesNotApplyError as reason:
        raise ClieError(f"{options.folder} cannot have the damage {options.damage}: "
                        f"{reason}") from None
    print(to_json(chosen) if options.json else f"{options.output}: "
          f"{DAMAGES[options.damage].sentence}")
    if chosen and not options.json:
        print(", ".join(f"{key} {value}" for key, value in chosen.items()), file=sys.stderr)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = command_parser("python -m clie_blocks.analysis.blind.imperfect", __doc__ or "",
                            output="damaged", output_help="folder of the copy")
    parser.add_argument("folder", nargs="?",
                        help="of one robot; without it, the damages are listed")
    parser.add_argument("--damage", metavar="NAME", help="which")
    parser.add_argument("--seed", type=int, default=0, help="of all chance")
    return parser


if __name__ == "__main__":
    run_main(main)
