"""Which OpenCL device the stages run on: every one is tried first, and one that fails gives way to the next.

After the last comes the NumPy reference, which every machine has. A trial runs in a process of its own and is
remembered by driver and processor, so it costs nothing in daily use.
"""

import hashlib
import json
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, Generic, TypeVar

from assets.formats import beside
from pipelines.caches import settle

REFERENCE = "reference"
"""What the NumPy twins are called, in settings and in reports."""

TRIAL_S = 120
"""How long a driver may take to build a kernel of thirty lines before it counts as hung. Chosen by hand."""
FORGET_S = 24 * 3600.0
"""After this long a device that failed is tried again: its disk may have been full. Chosen by hand: a day."""

Made = TypeVar("Made")
Answer = TypeVar("Answer")


class DeviceError(LookupError):
    """The device that was named cannot be used; the message says what would do."""


@dataclass(frozen=True)
class Tried:
    """A device after its trial.

    Parameters
    ----------
    index : int, its place among those found; -1 for the reference
    name, driver_version, kind, platform : str, as a person sees them
    reason : why it cannot be used, one line; empty where it can
    """

    index: int
    name: str
    driver_version: str
    kind: str
    platform: str
    reason: str = ""


class TrialMemory:
    """What trials came to, kept in the user's cache folder; a folder that cannot be written is no trouble.

    Parameters
    ----------
    folder : where the file lies; None: nothing is kept
    """

    def __init__(self, folder: Path | None) -> None:
        self._path = folder / "odori" / "devices.json" if folder else None

    def recall(self, key: str) -> str | None:
        """Look up why a device failed its trial, empty where it passed; None where it was not tried."""
        held = self._held().get(key)
        reason = held.get("reason") if isinstance(held, dict) else None
        if held is None or not isinstance(reason, str):
            return None
        is_old = not 0 <= time.time() - _number(held.get("at_s")) < FORGET_S
        return None if reason and is_old else reason

    def keep(self, key: str, name: str, reason: str) -> None:
        """Remember what a trial came to.

        Parameters
        ----------
        key : str, what names device, driver and processor
        name : str, for a person who looks into the file
        reason : why it cannot be used; empty where it can
        """
        if self._path is None:
            return
        held = self._held() | {key: {"name": name, "reason": reason, "at_s": time.time()}}
        with suppress(OSError), beside.written_beside(self._path) as partial:
            partial.write_text(json.dumps(held, sort_keys=True), encoding="utf-8")

    def _held(self) -> dict[str, Any]:
        try:
            held = json.loads(self._path.read_text(encoding="utf-8")) if self._path else {}
        except (OSError, ValueError):
            return {}
        return held if isinstance(held, dict) else {}


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else 0.0


class Devices:
    """The devices of this machine, and the one in use.

    Parameters
    ----------
    wanted : the setting ``opencl.device``: a name or index, ``reference``, or empty for the best that works
    say : what takes a line for the person who waits
    memory : of trials; None for the user's own
    """

    def __init__(
        self, wanted: str = "", *, say: Callable[[str], None] | None = None, memory: TrialMemory | None = None
    ) -> None:
        self.wanted = wanted
        self._say = say or to_standard_error
        self._memory = memory or TrialMemory(settle())
        self._failed: dict[int, str] = {}
        self._said = False

    @cached_property
    def _found(self) -> Sequence[Any]:
        """Devices there are; none where OpenCL itself is not."""
        if self.wanted.casefold() == REFERENCE:
            return ()
        return found_devices()

    def in_use(self) -> Any:  # noqa: ANN401 - a cl.Device, which mypy does not know
        """Give the device to compute on; None for the reference.

        Raises
        ------
        DeviceError
            If a device was named and is not there or cannot be used.
        """
        if self.wanted.casefold() == REFERENCE:
            return None
        if self.wanted:
            return self._named()
        for index in self._order():
            if not self.fault(index):
                return self._found[index]
        if not self._said:
            self._said = True
            self._say(_why_slow([self.describe(index) for index in self._order()]))
        return None

    def place(self, device: Any) -> int:  # noqa: ANN401 - a cl.Device
        """Give a device's place among those found.

        Parameters
        ----------
        device : cl.Device, one of them
        """
        return list(self._found).index(device)

    def name(self) -> str:
        """Name what computes, with its driver, as metadata and reports have it."""
        device = self.in_use()
        if device is None:
            return REFERENCE
        from kernels.opencl.device import full_name

        return full_name(device)

    def fault(self, index: int, *, anew: bool = False) -> str:
        """Say why a device cannot be used, from memory where its trial is known; empty where it can.

        Parameters
        ----------
        index : int, its place among those found
        anew : whether it is tried whatever is remembered
        """
        if index in self._failed:
            return self._failed[index]
        device = self._found[index]
        key = _identity(device)
        known = None if anew else self._memory.recall(key)
        if known is None:
            known = try_alone(index, device)
            self._memory.keep(key, device.name.strip(), known)
        if known:
            self._failed[index] = known
        return known

    def describe(self, index: int, *, anew: bool = False) -> Tried:
        """Describe a device and what its trial came to.

        Parameters
        ----------
        index, anew : as :meth:`fault` has them
        """
        from kernels.opencl.device import describe

        info = describe(self._found[index], index)
        driver = f"{info.driver} (bundled)" if info.is_bundled else info.driver
        return Tried(index, info.name, driver, info.kind, info.platform, self.fault(index, anew=anew))

    def all(self, *, anew: bool = True) -> list[Tried]:
        """Describe every device in the order in which they are taken, the reference last.

        Parameters
        ----------
        anew : whether each is tried whatever is remembered
        """
        import numpy as np

        there = [self.describe(index, anew=anew) for index in self._order()]
        return [*there, Tried(-1, REFERENCE, np.__version__, REFERENCE, "NumPy")]

    def give_up(self, device: Any, error: Exception) -> None:  # noqa: ANN401 - a cl.Device
        """Take a device out of use that failed in the middle of its work, and say so.

        Parameters
        ----------
        device : cl.Device, the one in use
        error : what it failed with

        Raises
        ------
        DeviceError
            If it was named: then no other takes its place unasked.
        """
        from kernels.opencl.trial import first_line

        index = self.place(device)
        reason, name = first_line(error), device.name.strip()
        if self.wanted:
            raise DeviceError(
                f"[opencl] device: {name} failed: {reason}; leave the setting out and the next that works takes over, "
                f"or name another ('{REFERENCE}' needs no driver)"
            ) from None  # a run tells the first cause of all, and that would be the driver's words alone
        self._failed[index] = reason
        self._said = True
        following = self.in_use()
        to = f"{following.name.strip()} takes over" if following else "the NumPy reference takes over, slower"
        self._say(f"{name} failed: {reason}; {to} and does the work again")

    def _named(self) -> Any:  # noqa: ANN401 - a cl.Device
        from kernels.opencl.choice import NoDeviceError, find_device, unusable
        from kernels.opencl.device import describe

        try:
            index = find_device(self.wanted, self._found)
        except NoDeviceError as error:
            raise DeviceError(f"[opencl] {error}") from error
        reason = self.fault(index)
        if reason:
            raise DeviceError(f"[opencl] {unusable(describe(self._found[index], index), reason)}")
        return self._found[index]

    def _order(self) -> list[int]:
        if not self._found:
            return []
        from kernels.opencl.choice import in_order

        return in_order(self._found)


class OnDevice(Generic[Made]):
    """Something built for the device in use, and built anew for the next one where that fails at its work.

    Parameters
    ----------
    devices : Devices
    make : builds it for a cl.Context, or for None on the reference
    """

    def __init__(self, devices: Devices, make: Callable[[Any], Made]) -> None:
        self._devices = devices
        self._make = make
        self._made: tuple[Any, Made] | None = None

    @property
    def name(self) -> str:
        """What computes, with its driver, for metadata."""
        return self._devices.name()

    def use(self, work: Callable[[Made], Answer]) -> Answer:
        """Do some work on it: whole on one device, and again from its beginning on the next where one fails.

        Parameters
        ----------
        work : of what was built; may be called several times

        Raises
        ------
        DeviceError
            If a device was named and fails.
        MemoryError
            If even the reference has not the memory.
        """
        while True:
            device = self._devices.in_use()
            if device is None:
                return work(self._built(None))
            try:
                return work(self._built(device))
            except (_opencl().Error, MemoryError) as error:
                self._made = None
                self._devices.give_up(device, error)

    def _built(self, device: Any) -> Made:  # noqa: ANN401 - a cl.Device or None
        if self._made is None or self._made[0] != device:
            self._made = device, self._make(None if device is None else _opencl().Context([device]))
        return self._made[1]


def found_devices() -> Sequence[Any]:
    """List the OpenCL devices there are, with cache folders a driver can write; none where OpenCL is not installed."""
    settle()
    try:
        from kernels.opencl.device import list_devices
    except ImportError:  # pyopencl has no build for this machine, or its loader is missing
        return ()
    return list_devices()


def try_alone(index: int, device: Any) -> str:  # noqa: ANN401 - a cl.Device
    """Try a device in a process of its own: a driver that crashes or hangs harms nothing.

    Parameters
    ----------
    index : int, its place among those found
    device : cl.Device, tried in this process where no other can be started

    Returns
    -------
    str, why it cannot be used, one line; empty where it can
    """
    command = [sys.executable, "-P", "-m", "pipelines.device_trial", str(index)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=TRIAL_S, check=False, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        return f"its driver did not answer within {TRIAL_S} s"
    except OSError:
        done = None
    if done is None or not sys.executable:
        from kernels.opencl.trial import fault

        return fault(device)
    for line in reversed(done.stdout.decode(errors="replace").splitlines()):
        with suppress(ValueError, KeyError, TypeError):
            return str(json.loads(line)["reason"])
    told = [line.strip() for line in done.stderr.decode(errors="replace").splitlines() if line.strip()]
    return f"its driver ended the trial with status {done.returncode}" + (f": {told[-1][:200]}" if told else "")


def _identity(device: Any) -> str:  # noqa: ANN401 - a cl.Device
    """Name a device, its driver and the processor: what a trial's outcome depends on."""
    import pyopencl as cl

    from kernels.opencl.trial import VERSION

    parts = (
        *(VERSION, device.platform.name, device.platform.version, device.name, device.driver_version, device.version),
        *(cl.version.VERSION_TEXT, _processor()),
    )
    return hashlib.sha256("\n".join(map(str, parts)).encode()).hexdigest()[:32]


@lru_cache(maxsize=1)
def _processor() -> str:
    """Name the processor, to tell it from others: by what the kernel says of it, else by its family."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").partition("\n\n")[0]
    except OSError:
        return f"{platform.machine()} {platform.processor()}"
    return "\n".join(line for line in text.splitlines() if "MHz" not in line and "bogomips" not in line.lower())


def _opencl() -> ModuleType:
    import pyopencl

    return pyopencl


def _why_slow(tried: Sequence[Tried]) -> str:
    from kernels.opencl.choice import REMEDY

    found = "; ".join(f"{device.name} ({device.driver_version}): {device.reason}" for device in tried)
    what = f"no OpenCL device works ({found})" if tried else "no OpenCL device is there"
    return f"{what}: matching, graph and calibration run on the NumPy reference, slower; {REMEDY} to make them fast"


def to_standard_error(line: str) -> None:
    """Write one line for the person who waits.

    Parameters
    ----------
    line : str
    """
    sys.stderr.write(f"odori: {line}\n")
