"""The live page: server, viewers, protocol."""

PORT = 8420
ACTS = ("mark", "acknowledge")  # what viewers may do, if it is permitted
