"""Images of particles: what they get once a group has run."""
import numpy as np
import pytest
from full import DX, FULL, make, subgroups
from pysph.base.nnps import DomainManager, LinkedListNNPS

from pysph_boiling.parallel.ghosts import GhostRefresh, Ghosts
from pysph_boiling.particles import BASE_PROPERTIES, fluid_block
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import MechanicalLedger, PhaseChange, SiteStorage
from pysph_boiling.schemes.stages import STAGES


def refreshed(equations):
    """Group name -> what its ghosts get once it has run."""
    return {group.name: hook.names for _, group in subgroups(equations) for hook in group.post or ()
            if isinstance(hook, GhostRefresh)}


def test_ghosts_are_refreshed_after_every_group_that_changes_what_neighbours_read():
    found = refreshed(make(effects=FULL, lean=False)[2])
    assert found["density_multiplier"] == ("lmbda",) and found["density_move"] == ("x", "y", "z")
    assert found["heat_temperature"] == ("T", "k") and found["heat_update"] == ("e", "T")
    assert found["phases_edges"] == ("phase", "T")
    assert found["bubbles_start"] == found["bubbles_snap"] == ("grandparent",) and found["bubbles_film"] == ("film",)


def test_groups_refresh_what_there_is():
    """A misspelt name would refresh nothing, in silence."""
    properties = {row.name for row in BASE_PROPERTIES}
    for effects in ({"mechanics": MechanicalLedger()},
                    {"phases": PhaseChange(kinetic="never"), "storage": SiteStorage()}):
        scene = BoilingScheme(["fluid"], ["wall"], dim=2, spacing=DX, **{**FULL, **effects}).scene()
        properties |= {row.name for effect in scene.effects.values()
                       for row in (*effect.properties(scene), *effect.wall_properties(scene))}
    named = {name for stage in STAGES for block in stage.blocks for spec in block.groups for name in spec.refresh}
    assert len(named) > 10 and named <= properties


def test_refresh_returns_at_once_without_ghosts(monkeypatch):
    scheme, arrays, equations = make(effects=FULL)
    monkeypatch.setattr(Ghosts, "refresh", lambda *_: pytest.fail("refreshed without ghosts"))
    scheme.ghosts.arrays = arrays[:1]
    scheme.ghosts.search_done()
    hooks = [hook for _, group in subgroups(equations) for hook in group.post or () if isinstance(hook, GhostRefresh)]
    assert hooks and all(hook.ghosts is scheme.ghosts for hook in hooks)
    for hook in hooks:
        hook()


def test_refresh_copies_to_the_images_and_keeps_their_shift():
    fluid = fluid_block((0.0, 0.0, 0.0), (6 * DX, 6 * DX, 0.0), spacing=DX, dim=2, rho0=1000.0)
    n = fluid.get_number_of_particles()
    domain = DomainManager(xmin=0.0, xmax=6 * DX, ymin=0.0, ymax=6 * DX, periodic_in_x=True, periodic_in_y=True)
    nnps = LinkedListNNPS(dim=2, particles=[fluid], radius_scale=2.0, domain=domain)
    nnps.update()
    ghosts = Ghosts()
    ghosts.arrays = [fluid]
    ghosts.search_done()
    assert fluid.get_number_of_particles() > 2 * n
    values = {name: fluid.get(name, only_real_particles=False) for name in ("x", "y", "u", "v", "uid")}
    uid = values["uid"]
    before = values["x"].copy()
    values["x"][:n] += 0.001 * np.arange(n)
    values["u"][:n] = np.arange(n)
    values["v"][:n] = np.arange(n)
    GhostRefresh(ghosts, ("x", "y", "z", "u"))()
    np.testing.assert_array_equal(values["u"][n:], uid[n:])
    np.testing.assert_allclose(values["x"][n:] - before[n:], 0.001 * uid[n:], atol=1e-15)
    assert not np.any(values["v"][n:]), "only what was named"
