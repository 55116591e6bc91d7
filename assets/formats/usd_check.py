"""What is wrong with a stage: USD's own validators, then our contract.

Conventions
-----------
Rules of USD carry USD's identifiers (``usdSkelValidators:…``), ours start with ``odori:``, and ``file`` stands for a
file that cannot be read. USD can abort or hang on a damaged file, so :func:`check` looks from a process of its own.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from pxr import Tf, Usd, UsdValidation

from assets.formats import usd_contract, usd_read
from assets.formats.errors import FormatError
from assets.formats.usd_contract import StageFinding

_NOT_LOADED = re.compile(r"\b(ModuleNotFoundError|ImportError|No module named)\b")


def check(path: str | Path, *, time_limit_s: float = 60.0) -> list[StageFinding]:
    """Look at any file that claims to be a stage, from a process of its own.

    Parameters
    ----------
    path : str or Path
    time_limit_s : float, > 0, seconds
        What a damaged file may keep USD busy for.

    Returns
    -------
    list of StageFinding
        Errors first; empty when all is well. A file that is missing, empty, damaged or no USD gives one finding.

    Raises
    ------
    ChildProcessError
        If that process could not load odori or USD: nothing was found out about the file.
    """
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(part for part in sys.path if part)}
    # -P: modules come from where ours came from, never from a folder of the same name where the user stands.
    command = [sys.executable, "-P", "-m", __name__, str(path)]
    try:
        done = subprocess.run(command, capture_output=True, env=environment, timeout=time_limit_s, check=False)
    except subprocess.TimeoutExpired:
        return [
            StageFinding(
                "error", "file", "", f"{path}: want a stage, got a file USD read for {time_limit_s:g} s; damaged?"
            )
        ]
    try:
        return [StageFinding(**finding) for finding in json.loads(done.stdout)]
    except ValueError:
        last = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        if done.returncode > 0 and _NOT_LOADED.search(last):
            raise ChildProcessError(f"{path}: want it checked, got no validator: {last}; install odori again") from None
        return [StageFinding("error", "file", "", f"{path}: want a stage, got a file that crashes USD; it is damaged")]


def inspect(path: str | Path) -> list[StageFinding]:
    """Look at a file in this process: for stages one has just written, since damage can take the process down.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    list of StageFinding
        As :func:`check`.
    """
    try:
        stage = usd_read.open_stage(path)
    except FormatError as error:
        return [StageFinding("error", "file", "", str(error))]
    findings: list[StageFinding] = []
    for rule in (_validators, *usd_contract.RULES):
        try:
            findings.extend(rule(stage))
        except (RuntimeError, TypeError, ValueError) as error:  # USD's own errors are RuntimeErrors
            damage = f"want values USD can read, got a damaged file: {usd_read.reason(error)}"
            findings.append(StageFinding("error", "file", "", damage))
    order = ("error", "warning", "note")
    return sorted(set(findings), key=lambda f: (order.index(f.severity), f.rule, f.prim_path, f.sentence))


def _validators(stage: Usd.Stage) -> Iterator[StageFinding]:
    """Ask every validator USD has."""
    try:
        validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    except Tf.ErrorException as failure:
        missing = f"USD's validators: want them loaded, got: {usd_read.reason(failure)}; only our contract was checked"
        yield StageFinding("warning", "odori:validators", "", missing)
        return
    kinds = UsdValidation.ValidationErrorType
    severity = {kinds.Error: "error", kinds.Warn: "warning", kinds.Info: "note"}
    for error in UsdValidation.ValidationContext(validators).Validate(stage):
        prims = [str(site.GetPrim().GetPath()) for site in error.GetSites() if site.IsValid() and site.GetPrim()]
        where = prims[0] if prims and prims[0] != "/" else ""
        yield StageFinding(severity.get(error.GetType(), "note"), str(error.GetIdentifier()), where, error.GetMessage())


if __name__ == "__main__":
    sys.stdout.write(json.dumps([asdict(finding) for finding in inspect(sys.argv[1])]))
