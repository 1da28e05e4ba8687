# SPDX-License-Identifier: BSD-3-Clause
"""``python -m gpureg`` and the script ``gpureg``: the command itself, as C++ compiled it."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import NoReturn

COMMAND = Path(__file__).with_name("bin") / "gpureg"


def main() -> NoReturn:
    """Become the command: its signals, its exit status, its output."""
    if not COMMAND.exists():
        sys.exit(
            "gpureg: this installation has the library only. The command needs CLI11, nlohmann-json and libpng where it is"
            " built: on Debian and Ubuntu `apt install libcli11-dev nlohmann-json3-dev libpng-dev`, then install gpureg again."
        )
    # It has this interpreter read the formats that libraries of Python read.
    environment = {"GPUREG_PYTHON": sys.executable, **os.environ}
    os.execve(COMMAND, ["gpureg", *sys.argv[1:]], environment)


if __name__ == "__main__":
    main()
