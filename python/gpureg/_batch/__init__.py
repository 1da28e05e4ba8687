# SPDX-License-Identifier: BSD-3-Clause
"""What runs of many pairs share: their plan, memory, store of results and table."""
