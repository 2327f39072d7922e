"""The count against the books, and what goes out to other programs."""
