"""The warehouse map: layout, routes' ways, racks, cells, closures, coverage."""
