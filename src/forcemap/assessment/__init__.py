"""A campaign's whole result: what the demo, the report and the web page show."""
