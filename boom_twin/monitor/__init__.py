"""The live page: server, viewers, protocol."""
