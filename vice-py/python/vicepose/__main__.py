"""The program ``vice``: ``python -m vicepose`` and the script of the wheel."""

from __future__ import annotations

import sys


def main() -> int:
    """Runs the program with the arguments of this process."""
    import signal

    from . import _vicepose

    # The interpreter would only note an interrupt, and look at it after the program has ended.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.stdout.flush()
    return _vicepose.main(["vice", *sys.argv[1:]], sys.executable)


if __name__ == "__main__":
    sys.exit(main())
