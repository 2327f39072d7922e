"""The painted, worn, lit floor as the down camera sees it."""
