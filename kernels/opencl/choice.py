"""Choosing an OpenCL device: by what a person named, else the best of those that pass their trial."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pyopencl as cl

from kernels.opencl.device import DeviceInfo, describe, list_devices
from kernels.opencl.trial import fault

REMEDY = "install a driver for the GPU, or one for the CPU (on Debian and Ubuntu: apt install pocl-opencl-icd)"
"""What makes a machine without a usable device fast."""

Fault = Callable[[cl.Device], str]
"""Why a device is of no use, one line; empty where it is usable."""


class NoDeviceError(LookupError):
    """There is no usable OpenCL device, or none as wanted; the message says what there is and what would do."""


def in_order(devices: Sequence[cl.Device]) -> list[int]:
    """Rank devices: GPUs, CPUs by a driver of the system, the CPU by the bundled driver, anything else.

    Parameters
    ----------
    devices : sequence of cl.Device

    Returns
    -------
    list of int, indices into `devices`, the first to be taken first; equals in the order given
    """
    infos = [describe(device, index) for index, device in enumerate(devices)]
    return sorted(range(len(infos)), key=lambda index: _rank(infos[index]))


def find_device(wanted: str | int, devices: Sequence[cl.Device]) -> int:
    """Find the device a person names.

    Parameters
    ----------
    wanted : int or str
        An index into `devices` (also as a string of digits); or a part of a device's or its platform's name, upper and
        lower case alike, first match.
    devices : sequence of cl.Device

    Returns
    -------
    int, index into `devices`

    Raises
    ------
    NoDeviceError
        If none is as wanted; the message lists what is there.
    """
    if isinstance(wanted, int) or wanted.isdecimal():
        if 0 <= int(wanted) < len(devices):
            return int(wanted)
    else:
        for index, device in enumerate(devices):
            if wanted.casefold() in f"{device.name} {device.platform.name}".casefold():
                return index
    there = "; ".join(str(describe(device, index)) for index, device in enumerate(devices))
    raise NoDeviceError(
        f"device: want {wanted!r}, found only {there}; name one of these by index or part of its name"
        if devices
        else f"device: want {wanted!r}, found none; {REMEDY}, or name 'reference', which needs none"
    )


def pick_device(wanted: str | int | None = None, *, fault: Fault = fault) -> cl.Device:
    """Pick a device that works, by name or by rule.

    Parameters
    ----------
    wanted : int, str or None
        As :func:`find_device` has it; None or empty: the first of :func:`in_order` that passes its trial.
    fault : the trial; see :func:`kernels.opencl.trial.fault`

    Returns
    -------
    cl.Device

    Raises
    ------
    NoDeviceError
        If there is no usable device, or the one wanted is not there or fails its trial. Never another than was named.
    """
    devices = list_devices()
    if wanted is not None and wanted != "":
        index = find_device(wanted, devices)
        reason = fault(devices[index])
        if reason:
            raise NoDeviceError(unusable(describe(devices[index], index), reason))
        return devices[index]
    reasons = []
    for index in in_order(devices):
        reason = fault(devices[index])
        if not reason:
            return devices[index]
        reasons.append(f"{describe(devices[index], index)}: {reason}")
    found = "found none" if not reasons else f"found none that works ({'; '.join(reasons)})"
    raise NoDeviceError(f"device: want an OpenCL device, {found}; {REMEDY}, or choose the reference backend")


def unusable(info: DeviceInfo, reason: str) -> str:
    """Say that a named device fails its trial, and what would do.

    Parameters
    ----------
    info : DeviceInfo
    reason : one line, as a trial gives it
    """
    return (
        f"device: {info} cannot be used: {reason}; mend its driver, name another, or leave the setting out: "
        "then the best that works is taken"
    )


def _rank(info: DeviceInfo) -> int:
    if info.kind == "CPU":
        return 2 if info.is_bundled else 1
    return 0 if info.kind == "GPU" else 3
