"""URLs of object stores: recognition, checking, and display without secrets.  All URLs are parsed here."""

import re
from pathlib import Path

from mc_engine.errors import EngineError

_EXAMPLE = "such as s3://bucket/runs/deorbit"
_BEGIN = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:/")  # of one letter it is a drive of Windows
ON_DISK = ("file", "local")
_WITH_USER = ("abfs", "abfss", "ftp", "hdfs", "sftp", "smb", "ssh", "webhdfs")  # what stands before @ is no secret
_HOST_OPTIONAL = (*ON_DISK, "memory", "hdfs", "dbfs")


def is_url(place: str | Path) -> bool:
    """True for the URL of an object store, also an incomplete one; False for a local path."""
    return "://" in str(place) or bool(_BEGIN.match(str(place)))


def without_secrets(text: str) -> str:
    """A URL without what precedes an @ and what follows a ? or #, so that it can be shown.  A path is unchanged."""
    if not is_url(text):
        return text
    shown = re.sub(r"(:/+).*@", r"\1***@", text, flags=re.DOTALL)
    return re.sub(r"(?<=[?#]).+", "***", shown, flags=re.DOTALL)


def store_url(text: str | Path) -> str:
    """A checked URL, its scheme in lower case and without a slash at the end.

    EngineError, whose text holds no secrets, if the URL is incomplete, ambiguous, or of an unknown store.
    """
    scheme, mark, rest = str(text).partition("://")
    scheme, rest = scheme.lower(), rest.rstrip("/")
    if problem := _problem(scheme, rest) if mark and _BEGIN.match(str(text)) else f"is no URL {_EXAMPLE}":
        raise EngineError(f"{without_secrets(str(text))}: {problem}")
    return f"{scheme}://{rest}"


def _problem(scheme: str, rest: str) -> str:
    """What is wrong with the parts of a URL; empty if nothing is."""
    host, *parts = rest.split("/")
    secret = re.search(r":.*@", rest, re.DOTALL) or ("@" in host and scheme not in _WITH_USER)
    rules = (
        (secret, "has credentials in it; give them in the environment, as the store's own tools read them"),
        (re.search(r"[?#]", rest), f"has a ? or #, behind which nothing counts; write a URL {_EXAMPLE}"),
        (not rest.isprintable() or " " in rest, "has a space or a character that cannot be seen; leave it out"),
        (not _is_known(scheme), f'"{scheme}" is no object store that is known; write a URL {_EXAMPLE}'),
        (scheme in ON_DISK and (host or not parts), f"names no absolute path; write {scheme}:///runs/deorbit"),
        (not host and (scheme not in _HOST_OPTIONAL or not parts), f"names no bucket or path; write one {_EXAMPLE}"),
        ({".", "..", ""} & {host or "x", *parts}, 'has an empty part, "." or ".." in its path; leave it out'),
    )
    return next((sentence for wrong, sentence in rules if wrong), "")


def _is_known(scheme: str) -> bool:
    """True if fsspec has a store for this scheme, or is not installed; whoever opens the URL then reports that."""
    try:
        from fsspec.registry import known_implementations, registry
    except ImportError:
        return True
    return scheme in known_implementations or scheme in registry
