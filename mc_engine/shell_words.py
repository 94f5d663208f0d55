"""Paths as words of the commands that are printed for the user to give next.

This module loads next to nothing: the command line does before it loads the rest of itself.
"""

import os
import shlex
import subprocess
from pathlib import Path


def shell_word(place: Path | str) -> str:
    """A path, a URL or the name of a campaign as the shell takes it for one word, and no command for an option."""
    text = str(place)
    text = f"./{text}" if text.startswith("-") else text
    # Windows: its shells know double quotes alone, and leave a backslash in peace
    return subprocess.list2cmdline([text]) if os.name == "nt" else shlex.quote(text)
