"""Final checks of a run. They raise exceptions of their own, because ``python -O`` switches ``assert`` off."""

__all__ = ["CheckFailed", "NotChecked", "require"]


class CheckFailed(AssertionError):
    """A run is complete, but its result is not what the scene must show; the message gives the value that fails.

    It is raised after the results, the closing lines and the pictures are written, so that nothing is lost.
    """


class NotChecked(Exception):
    """A check could not be made; the message says why: the run was too short, or lacked the effect to be checked."""


def require(holds, message):
    """Raise :class:`CheckFailed` with ``message`` unless ``holds``."""
    if not holds:
        raise CheckFailed(message)
