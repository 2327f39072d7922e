"""The scan of the shelves at a node: views, which code belongs where, when a look is enough."""
