"""Parts of the reproduction: the runs, the items compared, the errata, the plots."""
