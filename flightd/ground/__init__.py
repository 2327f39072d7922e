"""The ground station: a hub to the drones' ground links, and the page that shows and commands them.

drone --ZMQ--> `drone_link` -> `hub` -> one `browser` each --WebSocket--> page (`static/`)
page --HTTP POST--> `application` -> `acts` -> `drone_link` --ZMQ--> drone

A page is a folder in `static/app`, an entry in `static/app/pages.js` and a module of routes, `pages.page`
among them, mounted by `application`.  Stock: `stock_page` -> `stock_routes`, `expected_stock_routes`,
`decision_routes` -> `stores` (inventories, read-only), `decision_book`, `expected_stock_book` (the station's
own file); an upload is read by `uploaded_comparison` in a `reading_process`, as flights are.
Flights: `flights.routes` -> `flights.flights` -> `flights.flight_index` and `flights.flight_view`.
Guide: `guide_pages.routes` -> `guide_pages.rendering`, `guide_pages.search`.  What may wait: `bounded`.
"""
