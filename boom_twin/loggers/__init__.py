"""Tables of other programs: files, columns, units and times."""
