"""Work that outgrows one process: studies cut into blocks, their parts in a folder, pools and clusters."""
