import pytest

from kernels.opencl import device
from kernels.opencl.device import build, describe_devices, list_devices, only_device, real_type
from kernels.opencl.pocl_target import RELEASE

pytestmark = pytest.mark.opencl


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
        assert list_devices()[info.index].name.strip() == info.name
        assert info.is_bundled == (list_devices()[info.index].platform.version.strip() == RELEASE)


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


def test_all_devices_of_all_platforms_are_listed():
    if not (platforms := device.cl.get_platforms()):
        pytest.skip("no OpenCL driver here")
    assert list_devices() == [one for platform in platforms for one in platform.get_devices()]
