"""Reports of the commands that measure: sections, HTML pages, Markdown, pictures."""
