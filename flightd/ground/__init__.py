"""The ground station: a hub to the drones' ground links, and the page that shows and commands them.

drone --ZMQ--> `drone_link` -> `hub` -> one `browser` each --WebSocket--> page (`static/`)
page --HTTP POST--> `application` -> `acts` -> `drone_link` --ZMQ--> drone
"""
