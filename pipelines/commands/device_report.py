"""What ``odori status --devices`` says: every device after its trial, which one computes, and why."""

from pathlib import Path
from typing import Any

from assets.formats.settings_file import read_settings
from pipelines.commands.outcome import DONE, SOME_REFUSED, Outcome
from pipelines.device_fallback import DeviceError, Devices, Tried


def report(root: Path) -> Outcome:
    """Try every device anew and say what came of it.

    Parameters
    ----------
    root : a studio whose ``odori.toml`` counts; need not be there

    Returns
    -------
    Outcome
        With status 1 where the device that was named cannot be used.
    """
    said: list[str] = []
    devices = Devices(read_settings(root / "odori.toml").opencl.device, say=said.append)
    tried = Devices(say=said.append).all()
    troubles: list[str] = []
    chosen = None
    try:
        used = devices.in_use()
        chosen = next((t.index for t in tried if used is not None and t.index == devices.place(used)), -1)
    except DeviceError as error:
        troubles.append(f"odori.toml: {error.args[0]}")
    facts: list[dict[str, Any]] = [
        {
            "name": device.name,
            "platform": device.platform,
            "driver_version": device.driver_version,
            "kind": device.kind,
            "is_usable": not device.reason,
            "reason": device.reason or None,
            "is_chosen": device.index == chosen,
        }
        for device in tried
    ]
    lines = ["devices, the first that works is taken:" if not devices.wanted else "devices:"]
    lines += [f"  {_line(device, is_chosen=device.index == chosen)}" for device in tried]
    lines += [f"  odori.toml names {devices.wanted!r}"] if devices.wanted else []
    return Outcome(SOME_REFUSED if troubles else DONE, {"devices": facts}, "\n".join([*lines, *said]), troubles)


def _line(device: Tried, *, is_chosen: bool) -> str:
    mark = "*" if is_chosen else " "
    verdict = device.reason or ("computes" if is_chosen else "works")
    return f"{mark} {device.name} ({device.kind}, {device.platform} {device.driver_version}): {verdict}"
