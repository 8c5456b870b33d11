"""Placeholder: the package's public names come with the Python layer."""

from vlp_bpt import _native

__version__: str = _native.__version__
