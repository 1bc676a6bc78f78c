"""Reports: one document of sections, tables and pictures, as one HTML file and as Markdown."""
