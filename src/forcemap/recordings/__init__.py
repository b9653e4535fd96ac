"""What a force measuring device is; later: files of a device -> Recording."""
