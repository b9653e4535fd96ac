"""The command line: each command parses, makes one public call, and prints."""

from forcemap.cli.app import main

__all__ = ["main"]
