"""What differs from what: force models, effective mass, forms and terms, an old map and new impacts, two maps."""
