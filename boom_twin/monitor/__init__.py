"""The live page: server, viewers, protocol."""

PORT = 8420
