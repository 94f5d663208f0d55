"""Quoting of paths in the commands that messages suggest.  Imports little, so that the command line starts fast."""

import os
import shlex
import subprocess
from pathlib import Path


def shell_word(place: Path | str) -> str:
    """A path, a URL or a campaign's name, quoted as one word of the shell that no command takes for an option."""
    text = str(place)
    text = f"./{text}" if text.startswith("-") else text
    # The shells of Windows know double quotes only, and do not interpret a backslash.
    return subprocess.list2cmdline([text]) if os.name == "nt" else shlex.quote(text)
