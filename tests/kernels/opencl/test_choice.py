import pytest

from kernels.opencl import choice, device
from kernels.opencl.choice import NoDeviceError, find_device, in_order, pick_device
from kernels.opencl.device import list_devices
from kernels.opencl.pocl_target import RELEASE

pytestmark = pytest.mark.opencl
KINDS = device.cl.device_type


class Stub:
    """A device as far as choosing one looks at it."""

    def __init__(self, name, kind, platform="Platform P", version="OpenCL 3.0", reason=""):
        self.name, self.type, self.global_mem_size, self.driver_version = name, kind, 2**30, "1"
        self.platform = type("Platform", (), {"name": platform, "version": version})
        self.reason = reason


def fault(stub):
    return stub.reason


@pytest.fixture
def devices(monkeypatch):
    """A machine's devices, in the loader's order; to be changed."""
    found = [
        Stub("Odd card", KINDS.ACCELERATOR),
        Stub("Bundled CPU", KINDS.CPU, "PoCL", RELEASE),
        Stub("System CPU", KINDS.CPU, "PoCL"),
        Stub("Fast GPU 1", KINDS.GPU),
        Stub("Fast GPU 2", KINDS.GPU, "Other"),
    ]
    monkeypatch.setattr(choice, "list_devices", lambda: found)
    return found


def test_gpus_come_first_then_the_systems_driver_then_the_bundled_one(devices):
    names = [devices[index].name for index in in_order(devices)]
    assert names == ["Fast GPU 1", "Fast GPU 2", "System CPU", "Bundled CPU", "Odd card"]


@pytest.mark.parametrize(
    ("wanted", "index"),
    [(None, 3), ("", 3), (0, 0), ("2", 2), ("gpu 2", 4), ("fast", 3), ("bundled cpu", 1), ("other", 4)],
)
def test_picks_by_index_by_name_or_by_order(devices, wanted, index):
    assert pick_device(wanted, fault=fault) is devices[index]


def test_a_platform_whose_builds_fail_is_passed_over(devices):
    for stub in devices[2:]:
        stub.reason = "error: unknown target CPU 'generic'"
    assert pick_device(fault=fault) is devices[1]


def test_a_device_is_tried_only_when_its_turn_comes(devices):
    tried = []

    def watch(stub):
        tried.append(stub.name)
        return "" if stub.name == "Fast GPU 2" else "broken"

    pick_device(fault=watch)
    assert tried == ["Fast GPU 1", "Fast GPU 2"]


def test_where_none_works_each_is_named_with_its_reason(devices):
    for index, stub in enumerate(devices):
        stub.reason = f"reason {index}"
    with pytest.raises(
        NoDeviceError, match=r"Fast GPU 1.*: reason 3; .*: reason 4; .*reason 2; .*reason 1; .*reason 0"
    ):
        pick_device(fault=fault)


def test_a_named_device_that_fails_is_an_error_that_says_what_would_do(devices):
    devices[3].reason = "error: no such builtin"
    with pytest.raises(NoDeviceError, match=r"Fast GPU 1 .*: error: no such builtin; mend its driver, name another"):
        pick_device("fast gpu 1", fault=fault)


@pytest.mark.parametrize("wanted", [5, -1, "7", "quantum"])
def test_an_absent_device_is_an_error_that_lists_the_others(devices, wanted):
    with pytest.raises(NoDeviceError, match=r"0: Odd card \(other, Platform P\); 1: Bundled CPU \(CPU, PoCL\); 2: "):
        pick_device(wanted, fault=fault)
    with pytest.raises(NoDeviceError, match="want"):
        find_device(wanted, devices)


@pytest.mark.parametrize("wanted", [None, 0, "cpu"])
def test_no_device_is_an_error_with_a_remedy(devices, wanted):
    devices.clear()
    with pytest.raises(NoDeviceError, match=r"found none; install a driver .*apt install pocl-opencl-icd"):
        pick_device(wanted, fault=fault)


def test_a_real_device_is_picked_where_there_is_one():
    if not list_devices():
        pytest.skip("no OpenCL device here")
    assert pick_device() in list_devices()
