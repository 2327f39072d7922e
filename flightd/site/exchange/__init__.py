"""Maps of other programs: read into the tables of a site file, and written."""
