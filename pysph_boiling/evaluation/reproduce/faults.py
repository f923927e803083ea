"""Faults that were corrected since figures of the paper were last run: the report names them beside these figures."""

__all__ = ["caveat"]

CORRECTED = "2026-11-30"  # runs that finished before that day have these faults
SUPERHEAT = ("liquid exactly at saturation, whose heat is latent, was counted as superheated and could burst: 13 % of "
             "the particles counted, 41 % of the heat")
PUSH = ("the push of the oscillation constraint had no speed limit, and no ledger of its work; it threw the pool of "
        "Fig. 5 against its lid")
FAULTS = {"fig1": SUPERHEAT, "fig13": SUPERHEAT, "fig14": SUPERHEAT, "fig5": f"{PUSH}; {SUPERHEAT}", "fig6": PUSH,
          **dict.fromkeys(("fig7", "fig8", "fig9", "fig10", "fig11", "fig12", "table3", "table4"), PUSH)}


def caveat(section):
    """Sentences on a fault that the runs of a section have; empty once they were made again without it."""
    dates = [one["finished"][:10] for one in section.origins if one.get("finished")]
    if section.key not in FAULTS or not dates or min(dates) >= CORRECTED:
        return ""
    return (f"Not run again since {max(dates)}. These results still have a fault that was corrected later: "
            f"{FAULTS[section.key]}.")
