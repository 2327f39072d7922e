"""The ground store over HTTP, for programs: `endpoints` is what there is, `routes` serves it, `openapi` tells it."""
