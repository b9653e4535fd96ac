"""What the standard allows: force limits of body areas, and its contact model."""
