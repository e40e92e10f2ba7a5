"""The command ``rodfit``, also as ``python -m rodfit``."""

import signal
import sys

from . import _rodfit


def main() -> int:
    """Runs the command line and returns the exit code."""
    # The native command handles Ctrl-C itself.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _rodfit.command(["rodfit", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
