"""Results -> one pydantic model each: `--json` prints it, the page's /api serves the same, a schema describes it."""
