"""Which device computes: tried alone, remembered, given up; and the reference where there is none."""

import json
import subprocess
import time

import pyopencl as cl
import pytest

from kernels.opencl import choice, device
from kernels.opencl.device import list_devices
from pipelines import device_fallback as module
from pipelines.device_fallback import REFERENCE, DeviceError, Devices, OnDevice, TrialMemory, found_devices, try_alone

pytestmark = pytest.mark.opencl
KINDS = cl.device_type


class Stub:
    """A device of a made-up platform."""

    def __init__(self, name, kind=KINDS.CPU, reason=""):
        self.name, self.type, self.global_mem_size = name, kind, 2**30
        self.driver_version, self.version = "1.0", "OpenCL 3.0"
        self.platform = type("Platform", (), {"name": "Made up", "version": "OpenCL 3.0 made up"})
        self.reason = reason


@pytest.fixture
def machine(monkeypatch):
    """Put made-up devices in place of this machine's; each trial is counted."""

    def make(*stubs):
        tried = []

        def try_stub(index, stub):
            tried.append(stub.name)
            return stub.reason

        monkeypatch.setattr(module, "found_devices", lambda: list(stubs))
        monkeypatch.setattr(module, "try_alone", try_stub)
        monkeypatch.setattr(module, "_opencl", lambda: type("OpenCL", (), {"Error": cl.Error, "Context": list}))
        return tried

    return make


@pytest.fixture
def said():
    return []


@pytest.fixture
def devices(said, tmp_path):
    """Make the devices as a command does, telling a list."""
    return lambda wanted="": Devices(wanted, say=said.append, memory=TrialMemory(tmp_path))


def test_a_platform_whose_builds_fail_gives_way_to_the_next(machine, devices, said):
    broken, works = Stub("Card", KINDS.GPU, "error: unknown target CPU 'generic'"), Stub("CPU")
    machine(works, broken)
    assert devices().in_use() is works
    assert said == []
    assert [(t.name, t.reason) for t in devices().all()] == [
        ("Card", "error: unknown target CPU 'generic'"),
        ("CPU", ""),
        (REFERENCE, ""),
    ]


def test_without_any_device_the_reference_computes_and_says_so_once(machine, devices, said):
    machine()
    found = devices()
    assert [found.in_use() for _ in range(3)] == [None] * 3
    assert found.name() == REFERENCE
    assert len(said) == 1
    assert "no OpenCL device is there: matching, graph and calibration run on the NumPy reference" in said[0]
    assert "apt install pocl-opencl-icd" in said[0]


def test_where_every_device_fails_the_line_names_each(machine, devices, said):
    machine(Stub("Card", KINDS.GPU, "error: one"), Stub("CPU", reason="computes wrong"))
    assert devices().in_use() is None
    assert "Card (1.0): error: one; CPU (1.0): computes wrong" in said[0]


def test_hidden_from_the_loader_no_device_is_found(monkeypatch):
    def refuse():
        raise cl.LogicError("clGetPlatformIDs failed: PLATFORM_NOT_FOUND_KHR")

    monkeypatch.setattr(device.cl, "get_platforms", refuse)
    assert list(found_devices()) == []


def test_the_reference_can_be_named_and_looks_for_nothing(machine, devices, said):
    tried = machine(Stub("CPU"))
    for wanted in ("reference", "Reference"):
        assert devices(wanted).in_use() is None
    assert tried == []
    assert said == []


def test_a_named_device_that_fails_is_an_error_that_says_what_would_do(machine, devices):
    machine(Stub("CPU"), Stub("Card", KINDS.GPU, "error: one"))
    with pytest.raises(DeviceError, match=r"\[opencl\] device: 1: Card .* cannot be used: error: one; mend its driver"):
        devices("card").in_use()
    with pytest.raises(DeviceError, match=r"want 'no such', found only 0: CPU .*; 1: Card"):
        devices("no such").in_use()


def test_a_trial_is_remembered_and_its_device_never_tried_again(machine, devices):
    tried = machine(Stub("Card", KINDS.GPU, "error: one"), Stub("CPU"))
    devices().in_use()
    assert tried == ["Card", "CPU"]
    assert devices().in_use().name == "CPU"
    assert tried == ["Card", "CPU"]
    devices().all(anew=True)
    assert tried == ["Card", "CPU"] * 2


@pytest.mark.parametrize("what", ["driver_version", "version", "name"])
def test_another_driver_is_tried_anew(machine, devices, what):
    stub = Stub("CPU")
    tried = machine(stub)
    devices().in_use()
    setattr(stub, what, "other")
    devices().in_use()
    assert len(tried) == 2


def test_another_processor_is_tried_anew(machine, devices, monkeypatch):
    tried = machine(Stub("CPU"))
    devices().in_use()
    monkeypatch.setattr(module, "_processor", lambda: "another")
    devices().in_use()
    assert len(tried) == 2


def test_what_failed_is_tried_again_after_a_day(machine, devices, monkeypatch):
    stub = Stub("CPU", reason="the disk is full")
    tried = machine(stub)
    assert devices().in_use() is None
    stub.reason = ""
    assert devices().in_use() is None
    later = time.time() + module.FORGET_S + 1
    monkeypatch.setattr(module.time, "time", lambda: later)
    assert devices().in_use() is stub
    assert len(tried) == 2
    monkeypatch.setattr(module.time, "time", lambda: later + 100 * module.FORGET_S)
    assert devices().in_use() is stub  # what passed is remembered for good
    assert len(tried) == 2


@pytest.mark.parametrize("held", [b"", b"{", b"[]", b'{"x": 1}', b"\xff\xfe"])
def test_a_damaged_memory_is_no_memory(machine, devices, tmp_path, held):
    machine(Stub("CPU"))
    place = tmp_path / "odori" / "devices.json"
    place.parent.mkdir()
    place.write_bytes(held)
    assert devices().in_use().name == "CPU"
    assert len(json.loads(place.read_text())) >= 1


def test_a_memory_that_cannot_be_kept_is_no_trouble(machine, tmp_path):
    tried = machine(Stub("CPU"))
    (tmp_path / "odori").write_text("a file where the folder should be")
    for memory in (TrialMemory(tmp_path), TrialMemory(None)):
        assert Devices(memory=memory).in_use().name == "CPU"
    assert len(tried) == 2


def test_a_device_that_fails_at_its_work_gives_way_and_the_work_is_done_again(machine, devices, said):
    machine(Stub("Card", KINDS.GPU), Stub("CPU"))
    made = []

    def make(context):
        made.append(context[0].name if context else REFERENCE)
        return made[-1]

    def work(engine):
        if engine == "Card":
            raise cl.MemoryError("clEnqueueNDRangeKernel failed: MEM_OBJECT_ALLOCATION_FAILURE")
        return f"done by {engine}"

    on = OnDevice(devices(), make)
    assert [on.use(work) for _ in range(2)] == ["done by CPU"] * 2
    assert made == ["Card", "CPU"]
    assert said == [
        "Card failed: clEnqueueNDRangeKernel failed: MEM_OBJECT_ALLOCATION_FAILURE; "
        "CPU takes over and does the work again"
    ]
    assert on.name.startswith("CPU")


@pytest.mark.parametrize("error", [cl.RuntimeError("BUILD_PROGRAM_FAILURE"), MemoryError("no room")])
def test_after_the_last_device_comes_the_reference(machine, devices, said, error):
    machine(Stub("CPU"))

    def make(context):
        if context is not None:
            raise error
        return REFERENCE

    assert OnDevice(devices(), make).use(lambda engine: engine) == REFERENCE
    assert len(said) == 1
    assert "the NumPy reference takes over" in said[0]


def test_a_named_device_that_fails_at_its_work_is_an_error(machine, devices):
    machine(Stub("Card", KINDS.GPU), Stub("CPU"))

    def work(engine):
        raise cl.MemoryError("no room")

    with pytest.raises(
        DeviceError, match=r"Card failed: no room; leave the setting out .* \('reference' needs no driver"
    ):
        OnDevice(devices("card"), lambda context: context).use(work)


def test_other_errors_are_not_the_devices(machine, devices):
    machine(Stub("CPU"))

    def work(engine):
        raise ValueError("k: want >= 1, got 0")

    with pytest.raises(ValueError, match="want >= 1"):
        OnDevice(devices(), lambda context: context).use(work)


class TestAlone:
    def test_a_real_device_passes(self):
        if not list_devices():
            pytest.skip("no OpenCL device here")
        assert try_alone(0, list_devices()[0]) == ""

    @pytest.mark.parametrize(
        ("code", "reason"),
        [
            ("import os; os.abort()", "its driver ended the trial with status -6"),
            ("import sys; sys.exit('LLVM ERROR: no such target')", "status 1: LLVM ERROR: no such target"),
            ("print('noise'); print('{\"reason\": \"computes wrong\"}')", "computes wrong"),
            ("import time; time.sleep(60)", "did not answer within 1 s"),
        ],
    )
    def test_a_driver_that_crashes_or_hangs_is_told(self, monkeypatch, code, reason):
        real = subprocess.run
        monkeypatch.setattr(module, "TRIAL_S", 1 if "sleep" in code else 60)
        monkeypatch.setattr(module.subprocess, "run", lambda command, **how: real([command[0], "-c", code], **how))
        assert reason in try_alone(0, None)

    def test_where_no_process_can_be_started_it_is_tried_here(self, monkeypatch):
        def refuse(command, **how):
            raise OSError(11, "Resource temporarily unavailable")

        monkeypatch.setattr(module.subprocess, "run", refuse)
        monkeypatch.setattr("kernels.opencl.trial.fault", lambda stub: f"tried {stub} here")
        assert try_alone(0, "it") == "tried it here"


def test_the_remedy_is_one_sentence():
    assert "apt install pocl-opencl-icd" in choice.REMEDY
