"""The version of Carom, in one place for Python: that of the native module."""

from carom._carom import __version__

__all__ = ["__version__"]
