"""What runs here: this package, CasADi, and the IPOPT that CasADi brings, told without importing either."""

import importlib.metadata
import importlib.util
import re
import sys
from pathlib import Path

from loomopt.base import __version__

HEADER = Path("include", "coin-or", "IpoptConfig.h")
"""Where IPOPT says its version: beside CasADi's library in its wheel, below the prefix where both were built apart."""
UNTOLD = "of a version that it does not tell"
_TOLD = re.compile(r'^#define IPOPT_VERSION "(.+)"', re.MULTILINE)


def line() -> str:
    """Return the line that `loomopt --version` prints."""
    return f"loomopt {__version__} (CasADi {importlib.metadata.version('casadi')}, IPOPT {ipopt()})"


def ipopt() -> str:
    """Return the version of IPOPT, by the header that it was built with."""
    spec = importlib.util.find_spec("casadi")
    folders = [*(spec.submodule_search_locations or () if spec else ()), sys.prefix]
    for header in (Path(folder) / HEADER for folder in folders):
        if header.is_file() and (found := _TOLD.search(header.read_text(encoding="utf-8", errors="replace"))):
            return found[1]
    return UNTOLD
