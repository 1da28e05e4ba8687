# SPDX-License-Identifier: BSD-3-Clause
"""Results as rows of an Arrow table. No times: the same run gives the same bytes on any machine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pyarrow as pa

from .._core import RegistrationResult


def row_of(i: int, j: int, result: RegistrationResult) -> dict[str, Any]:
    """Fragment j into fragment i: target_from_source is Redwood's T_ij."""
    row: dict[str, Any] = {"i": i, "j": j}
    for name, value in result.to_dict().items():
        if isinstance(value, str | bool | int | float):
            row[name] = value
    row["target_from_source"] = (
        result.target_from_source.ravel().tolist() if result.has_pose else None
    )
    row["overlap_confidence"] = result.modes[0].overlap_confidence if result.modes else None
    row["information"] = result.source_moments.information_redwood().ravel().tolist()
    for name in type(result.statistics)._fields:
        row[name] = getattr(result.statistics, name)
    return row


def _type_of(name: str, value: Any) -> pa.DataType:
    if name in ("i", "j"):
        return pa.int32()
    if name == "overlap_confidence":
        return pa.float64()
    if name in ("target_from_source", "information"):
        return pa.list_(
            pa.float64()
        )  # not of fixed size: older readers of Parquet stumble over nulls among those
    kinds: dict[type, pa.DataType] = {
        str: pa.string(),
        bool: pa.bool_(),
        int: pa.int64(),
        float: pa.float64(),
    }
    return kinds[type(value)]


def table_of(rows: Sequence[dict[str, Any]]) -> pa.Table:
    """Rows, at least one, in the order given."""
    schema = pa.schema([(name, _type_of(name, value)) for name, value in rows[0].items()])
    return pa.Table.from_pylist(list(rows), schema=schema)
