"""Checks of what a run has shown. They are exceptions of our own, which ``python -O`` does not switch off."""

__all__ = ["CheckFailed", "NotChecked", "require"]


class CheckFailed(AssertionError):
    """A run is complete, but what it must show is not there; the message gives the figure that fails.

    It is raised after the results, the closing lines and the pictures, so that who catches it has all of them.
    """


class NotChecked(Exception):
    """A check is not made, and why: the run is too short for it, or leaves out what the check is about."""


def require(holds, message):
    """Raise :class:`CheckFailed` with ``message`` unless ``holds``."""
    if not holds:
        raise CheckFailed(message)
