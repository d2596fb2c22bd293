"""The program: `python -m crumple`, and the command `crumple` that comes with the package."""

import os
import signal
import subprocess
import sys

from crumple import _crumple
from crumple._commands import _program
from crumple._errors import Error


def main():
    # Ctrl-C ends the program at once, as without Python; a sweep installs its own way to stop.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.stdout.flush()
    if not hasattr(_crumple, "main"):
        try:
            words = [*_program(), *sys.argv[1:]]
        except Error as error:
            return f"error: {error}"
        if os.name == "posix":
            os.execvp(words[0], words)
        # Ctrl-C is the program's, which says where it stopped.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        return subprocess.call(words)
    return _crumple.main(["crumple", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
