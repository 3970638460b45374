"""The sections of the page, one file each: a run in, a panel out."""
