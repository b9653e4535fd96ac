"""A robot's path: read, cut into short pieces, given speeds that the map allows, and timed."""
