# SPDX-License-Identifier: BSD-3-Clause
"""Arrays in the memory of a GPU, without a round trip through the host."""

from __future__ import annotations

import sys
from typing import Any, NamedTuple

#: Types that become float32 on the device. float64 goes by the host, which looks for coordinates too large for float32.
_CONVERTED = ("float16", "bfloat16")


class DeviceRows(NamedTuple):
    """float32 rows on a device, as the core takes them."""

    address: int
    rows: int
    columns: int
    stride: int  # floats from one row to the next
    owner: Any  # keeps the memory alive


def on_device(value: Any) -> bool:
    """Whether value is an array in a GPU's memory."""
    if hasattr(value, "__dlpack_device__"):
        return bool(value.__dlpack_device__()[0] == 2)  # DLPack's kDLCUDA
    return hasattr(type(value), "__cuda_array_interface__")


def device_rows(value: Any) -> DeviceRows | None:
    """value as device rows; None for what is better copied to the host: float64, whole numbers,
    wrong shapes (and their errors).
    """
    if hasattr(value, "detach"):
        value = value.detach()  # a tensor that is part of a graph has no interface
    value = _with_interface(value)
    if value is None or len(value.shape) != 2 or 0 in value.shape:
        return None
    name = str(value.dtype).rpartition(".")[2]
    if name in _CONVERTED:
        value = value.float() if hasattr(value, "float") else value.astype("float32")
    elif name != "float32":
        return None
    interface = value.__cuda_array_interface__
    rows, columns = interface["shape"]
    strides = interface.get("strides") or (4 * columns, 4)
    if strides[1] != 4 or strides[0] % 4 or strides[0] < 4 * columns:
        value = value.contiguous() if hasattr(value, "contiguous") else value.copy(order="C")
        interface, strides = value.__cuda_array_interface__, (4 * columns, 4)
    return DeviceRows(interface["data"][0], rows, columns, strides[0] // 4, value)


def stream_of(value: Any) -> int:
    """The stream whose work made value: what reads it has to wait for that."""
    torch = sys.modules.get("torch")
    if torch is not None and isinstance(value, torch.Tensor):
        return int(torch.cuda.current_stream(value.device).cuda_stream)
    stream = value.__cuda_array_interface__.get("stream")
    return int(
        stream or 0
    )  # 0 is the default stream, which waits for all that does not refuse to be waited for


def _with_interface(value: Any) -> Any:
    if hasattr(value, "__cuda_array_interface__"):
        return value
    for library in ("cupy", "torch"):  # DLPack alone: one of these gives the address
        module = sys.modules.get(library)
        if module is not None:
            return module.from_dlpack(value)
    return None
