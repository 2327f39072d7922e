"""A whole ground station in a few lines: shows the flight, and sends it home when half the charge is gone.

python tools/ground_client.py [tcp://HOST:STATUS_PORT tcp://HOST:COMMAND_PORT]
"""

import json
import sys
import uuid

import zmq

status_at, command_at = sys.argv[1:] or ("tcp://127.0.0.1:5571", "tcp://127.0.0.1:5572")
context = zmq.Context()
status, command = context.socket(zmq.SUB), context.socket(zmq.REQ)
status.connect(status_at)
command.connect(command_at)
status.subscribe("")  # or only "status" or "event"
sent_home = False
while True:
    topic, body = status.recv_multipart()
    said = json.loads(body)
    if topic == b"event":
        print(said["level"], said["name"], said["text"], flush=True)
    elif said["vehicle"] and (said["vehicle"]["battery_frac"] or 1.0) < 0.5 and not sent_home:
        command.send_json({"version": 1, "id": uuid.uuid4().hex, "op": "command", "command": "home"})
        print(command.recv_json(), flush=True)
        sent_home = True
