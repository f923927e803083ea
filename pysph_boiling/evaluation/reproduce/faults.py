"""What has changed since figures of the paper were last run: the report says so beside these figures."""

__all__ = ["caveat"]

CORRECTED = "2026-11-30"  # runs that finished before that day have these faults
SUPERHEAT = ("liquid exactly at saturation, whose heat is latent, was counted as superheated and could burst: 13 % of "
             "the particles counted, 41 % of the heat")
PUSH = ("the push of the oscillation constraint had no speed limit, and no ledger of its work; it threw the pool of "
        "Fig. 5 against its lid")
FAULTS = {"fig1": SUPERHEAT, "fig13": SUPERHEAT, "fig14": SUPERHEAT, "fig5": f"{PUSH}; {SUPERHEAT}", "fig6": PUSH,
          **dict.fromkeys(("fig7", "fig8", "fig9", "fig10", "fig11", "fig12", "table3", "table4"), PUSH)}


def caveat(section):
    """Sentences on what the runs of a section lack or have wrong; empty once they were made again."""
    dates = [one["finished"][:10] for one in section.origins if one.get("finished")]
    if not dates or min(dates) >= CORRECTED:
        return ""
    fault = FAULTS.get(section.key)
    told = f" These results still have a fault that was corrected later: {fault}." if fault else ""
    return f"Not run again since {max(dates)}; the model and the statements have changed since.{told}"
