"""One reader per format; `formats` says which reads what."""
