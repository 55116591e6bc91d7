"""`odori check`: a stage validated."""

from pathlib import Path

from pipelines.commands.outcome import DONE, SOME_REFUSED, Outcome
from pipelines.studio.files import StudioError


def check_stage(file: Path) -> Outcome:
    """Validate a stage."""
    from assets.formats import usd_check

    if not file.is_file():
        raise StudioError(f"{file}: want a stage, got no such file; check the path")
    findings = usd_check.check(file)
    errors = [f for f in findings if f.severity == "error"]
    facts = {
        "file": str(file),
        "is_valid": not errors,
        "findings": [
            {"severity": f.severity, "rule": f.rule, "prim": f.prim_path, "sentence": f.sentence} for f in findings
        ],
    }
    lines = [f"{f.severity}: {f.rule}: {f.prim_path}: {f.sentence}" for f in findings]
    verdict = f"{file}: {'valid' if not errors else f'{len(errors)} errors'}"
    return Outcome(SOME_REFUSED if errors else DONE, facts, "\n".join([*lines, verdict]))
