"""The team's register: cells and their conditions, campaigns, releases and whether they are in force, in a database.

SQLite in a file by default, PostgreSQL by URL; one set of tables for both. Rows are added and never changed.
"""
