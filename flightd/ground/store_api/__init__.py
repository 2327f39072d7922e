"""The ground store over HTTP, for programs: `endpoints` says what there is, `openapi` and `routes` follow."""
