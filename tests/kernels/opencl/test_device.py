import pytest

from kernels.opencl import device
from kernels.opencl.device import (
    NoDeviceError,
    build,
    describe_devices,
    list_devices,
    only_device,
    pick_device,
    real_type,
)

pytestmark = pytest.mark.opencl


class Stub:
    """A device as far as picking one looks at it."""

    def __init__(self, name, kind, platform="Platform P"):
        self.name, self.type, self.global_mem_size, self.driver_version = name, kind, 2**30, "1"
        self.platform = type("Platform", (), {"name": platform})


@pytest.fixture
def three_devices(monkeypatch):
    kinds = device.cl.device_type
    devices = [Stub("Some CPU", kinds.CPU), Stub("Fast GPU 1", kinds.GPU), Stub("Fast GPU 2", kinds.GPU, "Other")]
    monkeypatch.setattr(device, "list_devices", lambda: devices)
    return devices


@pytest.mark.parametrize(
    ("wanted", "index"),
    [(None, 1), ("", 1), (0, 0), ("2", 2), ("gpu 2", 2), ("fast", 1), ("some cpu", 0), ("other", 2)],
)
def test_picks_by_index_by_name_or_the_first_gpu(three_devices, wanted, index):
    assert pick_device(wanted) is three_devices[index]


def test_without_a_gpu_the_cpu_is_picked(three_devices):
    del three_devices[1:]
    assert pick_device() is three_devices[0]


@pytest.mark.parametrize("wanted", [3, -1, "7", "quantum"])
def test_an_absent_device_is_an_error_that_lists_the_others(three_devices, wanted):
    with pytest.raises(NoDeviceError, match=r"0: Some CPU \(CPU, Platform P\); 1: Fast GPU 1 \(GPU, .*; 2: Fast GPU 2"):
        pick_device(wanted)


@pytest.mark.parametrize("wanted", [None, 0, "cpu"])
def test_no_device_is_an_error_with_a_remedy(monkeypatch, wanted):
    monkeypatch.setattr(device, "list_devices", list)
    with pytest.raises(NoDeviceError, match="found none; install a driver"):
        pick_device(wanted)


def test_no_driver_is_no_device(monkeypatch):
    def refuse():
        raise device.cl.Error("no platform")

    monkeypatch.setattr(device.cl, "get_platforms", refuse)
    assert list_devices() == []
    assert describe_devices() == []


def test_real_devices_are_described_in_their_order():
    if not list_devices():
        pytest.skip("no OpenCL device here")
    infos = describe_devices()
    assert [info.index for info in infos] == list(range(len(list_devices())))
    for info in infos:
        assert info.kind in ("GPU", "CPU", "other")
        assert info.memory_bytes > 0
        assert pick_device(info.index).name.strip() == info.name


@pytest.mark.parametrize("real", list_devices(), ids=lambda real: real.name.strip())
def test_kernels_are_built_with_their_constants_or_the_compiler_says_why(real):
    context = device.cl.Context([real])
    assert only_device(context) == real
    built = build(context, ["pose_distance.cl"], {"ROWS": 8, "LANES": 4}, flags=["-w"])
    assert [kernel.function_name for kernel in built.all_kernels()] == ["pose_distance"]
    with pytest.raises(device.cl.RuntimeError, match="BUILD_PROGRAM_FAILURE"):
        build(context, ["pose_distance.cl"], {"ROWS": 8, "LANES": "nonsense"})


def test_double_precision_is_refused_where_there_is_none():
    class Plain:
        name, double_fp_config = "Plain GPU ", 0

    assert real_type(Plain(), "single") == "float32"
    with pytest.raises(ValueError, match="want single on Plain GPU, got double"):
        real_type(Plain(), "double")
