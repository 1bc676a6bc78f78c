"""``python -m clie_blocks.analysis.reproduction``, which is ``clie reproduce``."""

from clie_blocks.analysis.reproduction.command import main
from clie_blocks.output import run_main

if __name__ == "__main__":
    run_main(main)
