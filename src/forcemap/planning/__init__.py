"""Joint room: design x expected force x limit -> what to measure, next, and to confirm."""
