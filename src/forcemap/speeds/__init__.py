"""Map x limit -> safe speed: at a place, on a zone or segment, on a grid."""
