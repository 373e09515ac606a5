"""The binary messages to the page.

A message is a sequence of blocks, each of a multiple of 8 bytes, all numbers little endian:

======  =====================  ==========================================================================
offset  type                   meaning
======  =====================  ==========================================================================
0       uint8                  kind: 1 = rows of a table, 2 = spectrum, 3 = columns of the spectrogram
1       uint8                  number of the table, its place in the newest ``layout`` message
2       uint16                 columns, c
4       uint32                 rows, k
8       float64 x k            kinds 1, 3: seconds since the session's epoch; kind 2: frequencies, Hz
8 + 8k  float32 x k x c        values column by column, then zeros up to a multiple of 8 bytes
======  =====================  ==========================================================================

A spectrum has one column for each column of the table that its number names; a spectrogram one for each of
`boom_twin.monitor.spectrogram.FREQUENCIES`. All else is JSON in text messages, with a key
``kind``: ``hello``, ``layout``, ``reset``, ``state``, ``alarms``, ``lines``, ``answer``.
"""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

ROWS, SPECTRUM, SPECTROGRAM = 1, 2, 3
HEAD = struct.Struct("<BBHI")


def pack(kind: int, table: int, times: NDArray[np.float64], values: NDArray[np.float32]) -> bytes:
    """One block: `times` (k,), `values` (k, c)."""
    rows, columns = values.shape
    body = values.T.astype("<f4").tobytes()
    return HEAD.pack(kind, table, columns, rows) + times.astype("<f8").tobytes() + body + bytes(-len(body) % 8)
