"""Reporting: reports on disk, two of them, and documents on terminal, page, JSON and Markdown."""
