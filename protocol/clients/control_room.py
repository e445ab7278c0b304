"""Control room that acknowledges the first event and sends the device that the policy proposes.

Run it with the address of the DVA: `python control_room.py 127.0.0.1:5600`.
"""

import sys
import time

import client
import zmq
from client import DVA, ask, field, register

client.ME = "56:2B:04:E4:56:E1"  # the DVA has to give this device the role `dispatch`


def decide(dva, request, content):
    """Send a request of a control room and return the reply."""
    return ask(dva, DVA, f"<Dispatch><{request}>{content}</{request}></Dispatch>")


if __name__ == "__main__":
    dva = zmq.Context.instance().socket(zmq.REQ)
    dva.connect(f"tcp://{sys.argv[1]}")
    register(dva, "desk", "ControlRoom")
    while "<EventID>" not in (events := decide(dva, "GetEventList", "")):
        time.sleep(0.5)
    event = f"<EventID>{field('EventID', events)}</EventID>"
    decide(dva, "Acknowledge", event)
    proposal = decide(dva, "GetProposal", event)
    device = f"<DeviceID>{field('DeviceID', proposal)}</DeviceID>"
    reply = decide(dva, "Assign", event + device)
    print("code", field("Code", reply), "and the event is", field("EventState", reply))
