"""``python -m clie_blocks.analysis.stability_report``, which is ``clie bounds``."""

from clie_blocks.analysis.stability_report.command import main
from clie_blocks.output import run_main

if __name__ == "__main__":
    run_main(main)
