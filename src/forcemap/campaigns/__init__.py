"""Impacts -> ImpactDataset: the impacts of one campaign, their states and the conditions they were measured under."""
