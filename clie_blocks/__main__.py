"""``python -m clie_blocks VERB ...`` is the installed command ``clie``."""

import sys
from importlib.metadata import entry_points


def main() -> int:
    """Run the command and return its exit code."""
    (command,) = entry_points(group="console_scripts", name="clie")
    code: int = command.load()()
    return code


if __name__ == "__main__":
    sys.exit(main())
