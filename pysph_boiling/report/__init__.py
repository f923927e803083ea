"""Reports of the commands that measure: sections, HTML pages, Markdown pages and pictures."""
