"""The shipped guide in the browser: its pages as HTML, a search over all of them, its pictures."""
