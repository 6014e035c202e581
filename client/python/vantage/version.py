"""The release, which is that of the repository."""

VERSION = "0.1.0"
