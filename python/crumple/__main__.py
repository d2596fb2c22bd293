"""The program: `python -m crumple`, and the command `crumple` that comes with the package."""

import signal
import sys

from crumple import _crumple


def main():
    # Ctrl-C ends the program at once, as without Python; a sweep installs its own way to stop.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.stdout.flush()
    return _crumple.main(["crumple", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
