"""Which OpenCL devices there are, and building kernels for one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Literal

import numpy as np
import pyopencl as cl

from kernels.opencl.pocl_target import RELEASE, name_target


@dataclass(frozen=True)
class DeviceInfo:
    """One device as a person sees it.

    Parameters
    ----------
    index : int, from 0, in the order of platforms and their devices
    name, platform, driver : str, as the driver says
    kind : "GPU", "CPU" or "other"
    memory_bytes : int, global memory
    is_bundled : bool
        Whether the driver came with the Python packages: a frozen release, slower than what a system brings.
    """

    index: int
    name: str
    platform: str
    driver: str
    kind: str
    memory_bytes: int
    is_bundled: bool = False

    def __str__(self) -> str:
        return f"{self.index}: {self.name} ({self.kind}, {self.platform})"


def full_name(device: cl.Device) -> str:
    """Name a device with its platform and driver, as metadata and reports have it.

    Parameters
    ----------
    device : pyopencl.Device

    Returns
    -------
    str
        ``device (platform driver)``, of which the driver's version is part: results may differ in their last bits.
    """
    return f"{device.name.strip()} ({device.platform.name.strip()} {device.driver_version.strip()})"


def list_devices() -> list[cl.Device]:
    """Find every OpenCL device, platforms in the loader's order; none is tried.

    Returns
    -------
    list of cl.Device; empty where no driver is installed
        Those of PoCL 3.0-rc2 have a processor's name that their compiler knows.
    """
    try:
        platforms = cl.get_platforms()
    except cl.Error:  # the loader's way of saying that there is no driver
        return []
    devices = []
    for platform in platforms:
        try:
            devices += platform.get_devices()
        except cl.Error:  # a platform without a device says so by an error
            continue
    for device in devices:
        name_target(device)
    return devices


def describe(device: cl.Device, index: int) -> DeviceInfo:
    """Describe one device.

    Parameters
    ----------
    device : cl.Device
    index : int, its place among :func:`list_devices`

    Returns
    -------
    DeviceInfo
    """
    return DeviceInfo(
        index=index,
        name=device.name.strip(),
        platform=device.platform.name.strip(),
        driver=device.driver_version.strip(),
        kind=_kind(device),
        memory_bytes=int(device.global_mem_size),
        is_bundled=device.platform.version.strip() == RELEASE,
    )


def describe_devices() -> list[DeviceInfo]:
    """Describe every device, in the order of :func:`list_devices`; empty where no driver is installed."""
    return [describe(device, index) for index, device in enumerate(list_devices())]


def only_device(context: cl.Context) -> cl.Device:
    """Give the device of a context of one.

    Parameters
    ----------
    context : cl.Context

    Returns
    -------
    cl.Device

    Raises
    ------
    ValueError
        If the context has not exactly one device.
    """
    if len(context.devices) != 1:
        raise ValueError(f"context: want one device, got {len(context.devices)}; make it from one device")
    return context.devices[0]


def real_type(device: cl.Device, precision: Literal["single", "double"]) -> np.dtype[np.floating]:
    """Give the type a device computes in.

    Parameters
    ----------
    device : cl.Device
    precision : "single" or "double"

    Returns
    -------
    numpy.dtype, float32 or float64

    Raises
    ------
    ValueError
        If the device has no double precision and that is wanted.
    """
    if precision == "double" and not device.double_fp_config:
        raise ValueError(f"precision: want single on {device.name.strip()}, got double; it has none")
    return np.dtype(np.float64 if precision == "double" else np.float32)


def build(
    context: cl.Context, files: Sequence[str], defined: Mapping[str, object], *, flags: Sequence[str] = ()
) -> cl.Program:
    """Build kernels of this package.

    Parameters
    ----------
    context : cl.Context
    files : names of ``.cl`` files, read as one
    defined : value of each constant of the source
    flags : further options of the compiler

    Returns
    -------
    cl.Program

    Raises
    ------
    cl.RuntimeError
        If the device's compiler refuses the source; its words are in the message.
    """
    folder = resources.files("kernels.opencl")
    source = "\n".join(folder.joinpath(file).read_text(encoding="utf-8") for file in files)
    constants = [part for name, value in defined.items() for part in ("-D", f"{name}={value}")]
    built: cl.Program = cl.Program(context, source).build([*flags, *constants])
    return built


def _kind(device: cl.Device) -> str:
    if device.type & cl.device_type.GPU:
        return "GPU"
    return "CPU" if device.type & cl.device_type.CPU else "other"
