"""The guide: Markdown pages that ship with the program, because warehouses are offline."""
