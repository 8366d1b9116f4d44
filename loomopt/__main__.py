"""The way in from the shell: closed streams and Ctrl-C are met before anything is imported that takes its time."""

import os
import sys

BAD_INPUT = 2


def main() -> None:
    """Run the command line; Ctrl-C while it is still being imported ends it as later on, without a traceback."""
    try:
        if not _open():
            os._exit(BAD_INPUT)
        from loomopt.base import interrupts

        interrupts.leave_at_once()
        from loomopt.interface.cli import app

        app.main()
    except KeyboardInterrupt:
        from loomopt.base import interrupts

        interrupts.leave()


def _open() -> bool:
    """Say whether both streams are there: one that is closed from the start is None to Python, and swallows all."""
    streams = {"standard output": sys.stdout, "standard error": sys.stderr}
    closed = [name for name, stream in streams.items() if stream is None]
    if closed and sys.stderr is not None:
        print(f"loomopt: {closed[0]} is closed. Send it to a file, a pipe or /dev/null.", file=sys.stderr)
    return not closed


if __name__ == "__main__":
    main()
