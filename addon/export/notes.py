"""What the export had to leave out or simplify: said once for each datablock, in the artist's words."""

from __future__ import annotations


class Notes:
    """Warnings in the order they were met, each only once."""

    def __init__(self) -> None:
        self.warnings: list[str] = []
        self._seen: set[str] = set()

    def warn(self, text: str) -> None:
        """Adds a warning, unless the same one was added before."""
        if text not in self._seen:
            self._seen.add(text)
            self.warnings.append(text)


class ExportError(Exception):
    """A scene that cannot be exported: the message names the datablock and the value at fault."""
