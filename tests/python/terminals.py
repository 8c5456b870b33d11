"""The command line on a terminal, where it shows its progress."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


class OnTerminal:
    """`vlp-bpt ARGUMENTS` with its standard error on a terminal."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self._terminal, inner = os.openpty()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "vlp_bpt", *arguments], cwd=folder, stdout=subprocess.PIPE, stderr=inner, text=True
        )
        os.close(inner)
        self.shown = b""

    def read_until(self, text: bytes | None) -> None:
        """Reads what is shown until `text` came, or to the end."""
        while text is None or text not in self.shown:
            try:
                read = os.read(self._terminal, 65536)
            except OSError:  # the other end was closed
                read = b""
            if not read:
                os.close(self._terminal)
                return
            self.shown += read
