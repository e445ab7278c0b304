"""Phone that reports a flood and prints what becomes of it.

Run it with the address of the DVA: `python phone.py 127.0.0.1:5600`.
"""

import sys

import client
import zmq
from client import DVA, ask, field, register
from heartbeats import listen

client.ME = "56:2B:04:E4:56:E2"
FLOOD = (
    "<Event><EventReport><Kind>flood</Kind><Position><Latitude>38.6612</Latitude>"
    "<Longitude>-9.2058</Longitude></Position><Severity>0.5</Severity>"
    "<Confidence>0.9</Confidence><Finding>detected</Finding></EventReport></Event>"
)


if __name__ == "__main__":
    news = listen(sys.argv[1], "event|")
    dva = zmq.Context.instance().socket(zmq.REQ)
    dva.connect(f"tcp://{sys.argv[1]}")
    register(dva, "phone", "Remote Control")
    status = ask(dva, DVA, FLOOD)
    number = field("EventID", status)
    while "<ClosedFor>" not in status:
        print(f"event {number} is {field('EventState', status)}", flush=True)
        while f"<EventID>{number}</EventID>" not in (status := news.recv_multipart()[1].decode()):
            pass
    print(f"event {number} was {field('EventState', status)}")
