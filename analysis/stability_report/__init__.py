"""The stability report: quantities, the study that they belong to, the document and its plots."""
