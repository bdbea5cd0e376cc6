"""Documents on a terminal, on a page, in Markdown and in other formats."""
