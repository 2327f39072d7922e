"""An example of how a warehouse system is connected: Odoo's stock goes to a ground station as expected stock,
and what was counted comes back as inventory adjustments that a person has approved.

It uses what every such program can use: Odoo's External JSON-2 API, the drop folder of `flightd store
exchange`, and the ground store's `/api/v1` with a key of scope `stock`.
"""
