"""The force measuring device and its files: file -> Recording."""
