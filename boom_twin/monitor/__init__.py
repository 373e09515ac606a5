"""The live page: server, viewers, protocol."""

PORT = 8420
ACTS = ("mark", "acknowledge")  # actions of viewers, each permitted at start or not
