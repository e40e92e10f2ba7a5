"""The command ``rodfit``; ``python -m rodfit`` too."""

import signal
import sys

from . import _rodfit


def main() -> int:
    """Does what the command line says; the exit code."""
    # The command's own: Ctrl-C ends it, or lets a fit end with the best so far.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _rodfit.command(["rodfit", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
