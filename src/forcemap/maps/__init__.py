"""ImpactDataset -> ForceMap: the collision-force map F(d, h, v), its accuracy and its upper bounds."""
