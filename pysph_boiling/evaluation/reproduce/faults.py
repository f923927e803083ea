"""What figures of the paper rested on before faults were mended: said beside each until it is run again."""

__all__ = ["caveat"]

MENDED = "2026-11-30"  # runs that finished before that day were made with these faults
SUPERHEAT = ("liquid exactly at saturation, whose heat is latent, was counted as superheated and could burst: 13 % of "
             "the particles counted, 41 % of the heat")
PUSH = ("the push of the oscillation constraint had no speed limit, its work no ledger: it threw the pool of Fig. "
        "5 at its lid")
FAULTS = {"fig1": SUPERHEAT, "fig13": SUPERHEAT, "fig14": SUPERHEAT, "fig5": f"{PUSH}; {SUPERHEAT}", "fig6": PUSH,
          **dict.fromkeys(("fig7", "fig8", "fig9", "fig10", "fig11", "fig12", "table3", "table4"), PUSH)}


def caveat(section):
    """A sentence on a fault that the runs of a section had, empty once they were made again on mended code."""
    dates = [one["finished"][:10] for one in section.origins if one.get("finished")]
    if section.key not in FAULTS or not dates or min(dates) >= MENDED:
        return ""
    return (f"Not run again since {max(dates)}. Until it is, it rests on a fault that is mended since: "
            f"{FAULTS[section.key]}.")
