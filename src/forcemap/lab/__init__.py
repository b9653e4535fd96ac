"""The virtual impact lab: simulated impacts of robots on a measuring device. Nothing of it is a measurement."""
