"""A trial of one OpenCL device in a process of its own, where a driver that crashes or hangs harms nothing.

    python -m pipelines.device_trial INDEX

prints one JSON object, ``{"reason": ""}`` or why the device is of no use.
"""

import json
import sys

from kernels.opencl.device import list_devices
from kernels.opencl.trial import fault


def main() -> None:
    """Try the device of the index given, among those :func:`kernels.opencl.device.list_devices` finds."""
    devices, index = list_devices(), int(sys.argv[1])
    reason = fault(devices[index]) if index < len(devices) else "is not there any more"
    sys.stdout.write(json.dumps({"reason": reason}) + "\n")


if __name__ == "__main__":
    main()
