"""Joint: map x new impacts, does the map still hold; map x map, how they differ; what censored impacts change."""
