"""Parts of the model in another scheme of PySPH: groups that would be wrong in silence if put together by hand."""
from pysph.sph.equation import Group

from pysph_boiling.equations import bubble_groups
from pysph_boiling.parallel.ghosts import GhostRefresh, Ghosts
from pysph_boiling.particles import add_properties, number
from pysph_boiling.schemes.effects.bubbles import BubbleLabels

__all__ = ["label_groups"]


def label_groups(pa, *, radius):
    """Groups that label the bubbles of an array, to be added to the equations of any scheme.

    Vapour (``phase`` 3) nearer than ``radius`` [m] to each other belongs together; afterwards ``bubble`` is the
    smallest uid of a particle's bubble, ``NO_BUBBLE`` outside. ``radius`` is at most the support of the kernel. The
    domain may be periodic. The array gets what the labels need, ``uid`` included.

    Errors: ``ValueError`` if radius <= 0, or if the array has no ``phase``.   Limits: not on several ranks.
    """
    if "phase" not in pa.properties:
        raise ValueError(f"labels of bubbles need the property 'phase' (int) of '{pa.name}'; see pysph_boiling.phases")
    number(pa)
    add_properties(pa, BubbleLabels().properties(None))
    for name, value in BubbleLabels().constants(None).items():
        if name not in pa.constants:
            pa.add_constant(name, value)
    ghosts = Ghosts()
    ghosts.arrays = [pa]
    refresh = GhostRefresh(ghosts, ("grandparent",))
    rounds = [Group([bubble_groups.BubbleSnap(pa.name, None)], post=refresh, name="snap"),
              Group([bubble_groups.BubbleHook(pa.name, [pa.name], radius=radius)], name="hook"),
              Group([bubble_groups.BubbleShortcut(pa.name, None)], name="shortcut"),
              Group([bubble_groups.BubbleCheck(pa.name, None)], name="check")]
    return [Group([bubble_groups.BubbleStart(pa.name, None)], pre=ghosts.search_done, name="start"),
            Group(rounds, iterate=True, max_iterations=BubbleLabels.MAX_ROUNDS, name="rounds"),
            Group([bubble_groups.BubbleLabel(pa.name, None)], name="label")]
