import json
import subprocess
import sys

import pytest

from kernels.opencl.device import list_devices

pytestmark = pytest.mark.opencl
DEVICES = list_devices()


def test_alone_it_answers_with_one_object():
    command = [sys.executable, "-m", "pipelines.device_trial"]
    for index in range(len(DEVICES)):
        done = subprocess.run([*command, str(index)], capture_output=True, text=True, check=True)
        assert json.loads(done.stdout) == {"reason": ""}
    done = subprocess.run([*command, str(len(DEVICES))], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == {"reason": "is not there any more"}
