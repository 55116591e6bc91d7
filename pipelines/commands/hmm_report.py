"""Report of a dance by the model of a dancer: what the model was learned from, and what the music adds."""

from typing import Any

from assets.tables import hmm as hmm_tables
from pipelines.studio.lake import Lake

_NOBODY = (
    "no clip{of} was danced to a song of this studio, so the model has no music to learn from: motions follow each "
    "other as in the clips, in another order for every --seed, and of the music only the beats count; to change that, "
    "name the song in clips.csv (performed_to), or give both files one name"
)
_FEW = "the performances are too short to measure whether their music matters; add longer ones"


def model_facts(lake: Lake, *, subject: str = "") -> dict[str, Any]:
    """Gather facts of the model: performances, what the music adds, and sentences a user should read.

    Parameters
    ----------
    lake : Lake
    subject : setting ``choreography_model.subject``, whose performances alone were learned from; all where empty
    """
    performed = {row["clip_id"] for row in lake.table("performance").to_pylist()}
    if subject:
        clips = [row for key in lake.keys("clip") for row in lake.table("clip", key).to_pylist()]
        performed &= {row["clip_id"] for row in clips if row["subject"] == subject}
    n_performances = len(performed)
    found = hmm_tables.to_evidence(lake.table("music_evidence"))
    states = lake.table("basic_motion").num_rows
    if not n_performances:
        notes = [_NOBODY.format(of=f" of {subject}" if subject else "")]
    elif not found.n_motions.any():
        notes = [_FEW]
    elif not found.music_adds:
        notes = [
            f"the music of the {n_performances} performances does not help to predict the next motion (gain "
            f"{found.gain:.3f} nats a motion, p {found.p:.3f}: how often shuffled music does as well): the dance "
            "follows the dancer, not the drums"
        ]
    else:
        notes = []
    return {
        "performances": n_performances,
        "basic_motions": states,
        "music_adds": found.music_adds,
        "music_gain_nats": found.gain,
        "music_p_probability": found.p,
        "notes": notes,
    }


def dance_notes(report: dict[str, Any]) -> list[str]:
    """Say why a dance is not as wanted, where that is known: its tempo is none the dancer moved at, or it is short."""
    wanted, notes = report["wanted"], []
    if _failed(wanted, "warp_easy_ratio"):
        notes.append(
            "few motions are as long as the song's beats need: some are danced beyond 0.90 to 1.10 of their pace; "
            "add clips danced near its tempo, or set beats.octave in its brief"
        )
    if _failed(wanted, "beat_p_probability") or _failed(wanted, "beat_f_p_probability"):
        notes.append("the dance is too short, or moves too evenly, to tell its beats from chance")
    if _failed(wanted, "seam_jerk_ratio") and wanted["seam_jerk_ratio"]["value"] <= 1.5:
        notes.append(
            "seams are within 1.5 times the clips' own jerk, but poses there are so alike that a plain cut is as "
            "smooth: a blend cannot improve on it"
        )
    if any(_failed(wanted, name) and wanted[name]["value"] > 1.5 for name in _ROUGH):
        notes.append(
            "some of the recordings that fit its beats join only roughly: they are rough themselves, or calm beside a "
            "wilder one; add clips danced near its tempo, or try wider blends (dance.blend_s = 0.55)"
        )
    if any(_failed(wanted, name) for name in ("added_foot_slide_cm_per_s", "knee_pop_ratio")):
        notes.append(
            "recordings that fit its beats stand differently where they meet, and feet or knees give way there; add "
            "clips danced near its tempo"
        )
    return notes


_ROUGH = ("seam_jerk_ratio", "seam_jerk_worst_ratio", "seam_jerk_median_ratio")


def _failed(wanted: dict[str, Any], name: str) -> bool:
    return name in wanted and wanted[name]["is_passed"] is False


def report_lines(facts: dict[str, Any]) -> list[str]:
    """Write what the model was learned from, and what a director should know of it."""
    lines = [f"  {facts['basic_motions']} basic motions, learned from {facts['performances']} performances"]
    if facts["music_adds"]:
        gain, p = facts["music_gain_nats"], facts["music_p_probability"]
        lines.append(
            f"  the music helps to predict the next motion: {gain:+.2f} nats a motion (gain in log probability), "
            f"p {p:.3f} (how often shuffled music does as well)"
        )
    return lines + [f"  note: {note}" for note in facts["notes"]]
