"""Parts of the model for other PySPH schemes: groups that are easily put together wrongly without an error."""
from pysph.sph.equation import Group

from pysph_boiling.equations import bubble_groups
from pysph_boiling.parallel.ghosts import GhostRefresh, Ghosts
from pysph_boiling.particles import add_properties, number
from pysph_boiling.schemes.effects.bubbles import BubbleLabels

__all__ = ["label_groups"]


def label_groups(pa, *, radius):
    """Groups that label the bubbles of the array ``pa``, to be added to the equations of any scheme.

    Vapour particles (``phase`` 3) closer than ``radius`` [m], which is at most the kernel support, belong together.
    Afterwards the property ``bubble`` is the smallest uid in a particle's bubble, or ``NO_BUBBLE``. The domain may be
    periodic. All properties that are needed, including ``uid``, are added to the array.

    Errors: ``ValueError`` if radius <= 0, or if the array has no ``phase``.   Limits: not on several ranks.
    """
    if "phase" not in pa.properties:
        raise ValueError(f"to label bubbles, array '{pa.name}' needs the property 'phase' (int); see "
                         "pysph_boiling.phases")
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
