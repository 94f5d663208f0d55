"""Where the numbers of a run come from: versions, processor, state of the sources.  No names, no absolute paths."""

import platform
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

from mc_engine.sampling.streams import SEED_CONTRACT

PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "pandas", "pyarrow", "joblib", "pydantic")


def engine_version() -> str:
    """Version of the installed engine; "source" where it runs without being installed."""
    try:
        return metadata.version("mc-engine")
    except metadata.PackageNotFoundError:
        return "source"


def environment() -> dict[str, Any]:
    """Interpreter, platform, processor, packages, and the git state of the engine's own sources."""
    import llvmlite.binding as llvm
    import numba

    return {
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        "cpu": str(llvm.get_host_cpu_name()),
        "packages": {name: metadata.version(name) for name in PACKAGES},
        "numba": numba.__version__,
        "llvm": ".".join(map(str, llvm.llvm_version_info)),
        "git": git_state(Path(__file__).parent),
        "seed_contract": SEED_CONTRACT,
    }


def git_state(folder: Path) -> dict[str, Any] | None:
    """Commit of the repository that tracks `folder` and whether anything differs from it; None without one."""
    commit = _git(folder, "log", "-1", "--format=%H", "--", ".")
    if not commit:
        return None
    return {"commit": commit, "dirty": bool(_git(folder, "status", "--porcelain", "--", "."))}


def _git(folder: Path, *arguments: str) -> str:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *arguments], capture_output=True, text=True, timeout=10.0, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
